// SPDX-License-Identifier: Apache-2.0
// Diffuse surfaces whose reflectance is that of a texture's texels.
#include "surfaces/textured.h"

#include <cmath>

#include "surfaces/lambertian.h"

namespace deltalux::surfaces {
namespace {

/// Texels relative to their mean, as far as they count; 1 for a channel whose mean is black.
Vec3f relative(const Texture::Weighted& texel, Vec3f gain) {
  Vec3f out{1, 1, 1};
  for (int c = 0; c < 3; ++c)
    if (gain[c] > 0) out[c] = texel.colour[c] * gain[c] + (1 - texel.weight);
  return out;
}

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

class Textured final : public Lambertian {
 public:
  Textured() : Lambertian(Reads::texture) {}
  std::string_view name() const override { return "textured"; }
  const char* flaw(std::span<const float> parameters) const override {
    return parameters.empty() ? nullptr : "parameters, which a textured surface has none of";
  }
  Vec3f tint(const Surface& surface, const SurfacePoint& at) const override {
    const TextureMap& map = *surface.map;
    const Place place = place_in(map, at);
    if (!is_finite(place)) return {1, 1, 1};
    return relative(map.texture->at(place[0], place[1], map.sampler), map.gain);
  }
  void fetch(const Surface& surface, const SurfacePoint& at) const override {
    const TextureMap& map = *surface.map;
    if (const Place place = place_in(map, at); is_finite(place))
      map.texture->fetch(place[0], place[1], map.sampler);
  }
  Vec3f max_tint(const Surface& surface) const override {
    // Points that do not count have the mean.
    return max(relative({surface.map->texture->brightest(), 1}, surface.map->gain), Vec3f{1, 1, 1});
  }
};

}  // namespace

Surface textured(Surface surface, TextureMap map) {
  static const Textured kind;
  surface.kind = &kind;
  surface.map = std::make_shared<const TextureMap>(std::move(map));
  return surface;
}

}  // namespace deltalux::surfaces
