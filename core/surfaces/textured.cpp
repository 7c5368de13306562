// SPDX-License-Identifier: Apache-2.0
// Diffuse surfaces whose reflectance is that of a texture's texels.
#include "surfaces/textured.h"

#include <cmath>

#include "surfaces/lambertian.h"
#include "surfaces/pane.h"

namespace deltalux::surfaces {
namespace {

using Place = std::array<float, 2>;

/// Where a point lies in the image; not finite where it has no coordinates.
Place place_in(const TextureMap& map, const SurfacePoint& at) {
  Place place;
  for (size_t k = 0; k < 2; ++k) {
    const auto& row = map.matrix[k];
    place[k] = row[0] * at.texture[0] + row[1] * at.texture[1] + row[2];
  }
  return place;
}

bool is_finite(const Place& place) { return std::isfinite(place[0]) && std::isfinite(place[1]); }

constexpr float kSolid = 0.5f;  // least weight of texels that are no holes

class Textured final : public Lambertian {
 public:
  Textured() : Lambertian(Reads::texture) {}
  std::string_view name() const override { return "textured"; }
  const char* flaw(std::span<const float> parameters) const override {
    return parameters.empty() ? nullptr : "parameters, which a textured surface has none of";
  }
  bool is_opaque(const Surface& surface) const override {
    return !surface.map->cut_out || surface.map->texture->least_weight() >= kSolid;
  }
  bool stops(const Surface& surface, const SurfacePoint& at) const override {
    const auto texel = texel_at(*surface.map, at);
    return !texel || texel->weight >= kSolid;
  }
  Vec3f tint(const Surface& surface, const SurfacePoint& at) const override {
    const auto texel = texel_at(*surface.map, at);
    return texel ? relative(*texel, surface.map->gain) : Vec3f{1, 1, 1};
  }
  void fetch(const Surface& surface, const SurfacePoint& at) const override {
    fetch_texel(*surface.map, at);
  }
  Vec3f max_tint(const Surface& surface) const override { return most_relative(*surface.map); }
};

}  // namespace

Vec3f relative(const Texture::Weighted& texel, Vec3f gain) {
  Vec3f out{1, 1, 1};
  for (int c = 0; c < 3; ++c)
    if (gain[c] > 0) out[c] = texel.colour[c] * gain[c] + (1 - texel.weight);
  return out;
}

Vec3f most_relative(const TextureMap& map) {
  // Points that do not count have the mean.
  return max(relative({map.texture->brightest(), 1}, map.gain), Vec3f{1, 1, 1});
}

std::optional<Texture::Weighted> texel_at(const TextureMap& map, const SurfacePoint& at) {
  const Place place = place_in(map, at);
  if (!is_finite(place)) return {};
  return map.texture->at(place[0], place[1], map.sampler);
}

void fetch_texel(const TextureMap& map, const SurfacePoint& at) {
  if (const Place place = place_in(map, at); is_finite(place))
    map.texture->fetch(place[0], place[1], map.sampler);
}

Surface textured(Surface surface, TextureMap map) {
  static const Textured kind;
  surface.kind = surface.kind == &pane() ? &textured_pane() : &kind;
  surface.map = std::make_shared<const TextureMap>(std::move(map));
  return surface;
}

}  // namespace deltalux::surfaces
