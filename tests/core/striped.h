// SPDX-License-Identifier: Apache-2.0
// A kind of surface that no scene has: stripes by texture coordinates, and holes. For tests.
#pragma once
#include <cmath>

#include "scene/scene.h"
#include "surfaces/lambertian.h"

namespace deltalux::surfaces {

/// Bright where the fraction of the first texture coordinate is below a half, dark elsewhere; one
/// channel has no stripes. If its parameter is 1, there are holes where the fraction of the second
/// is below a half.
class Striped final : public Lambertian {
 public:
  static constexpr Vec3f kBright{1.2f, 1.2f, 1}, kDark{0.2f, 0.2f, 1};

  Striped() : Lambertian(Reads::texture) {}
  std::string_view name() const override { return "striped"; }
  const char* flaw(std::span<const float> parameters) const override {
    return parameters.size() == 1 ? nullptr : "other parameters than whether there are holes";
  }
  Vec3f tint(const Surface&, const SurfacePoint& at) const override {
    return below_half(at.texture[0]) ? kBright : kDark;
  }
  Vec3f max_tint(const Surface&) const override { return kBright; }
  bool is_opaque(const Surface& surface) const override { return surface.parameters[0] == 0; }
  bool stops(const Surface&, const SurfacePoint& at) const override {
    return !below_half(at.texture[1]);
  }

 private:
  static bool below_half(float x) { return x - std::floor(x) < 0.5f; }
};

inline Surface striped(Vec3f reflectance, bool holes = false) {
  static const Striped kind;
  Surface surface{reflectance, {}, false, &kind, {holes ? 1.0f : 0.0f}, "stripes"};
  return surface;
}

/// Texture coordinates by place: `scale` of them to a metre, along x + z and along y.
inline void add_texture(scene::Object& object, float scale) {
  object.texture.clear();
  for (const auto& triangle : object.triangles) {
    std::array<std::array<float, 2>, 3> own;
    for (size_t k = 0; k < 3; ++k) {
      const Vec3f p = object.vertices[triangle[k]];
      own[k] = {scale * (p.x + p.z), scale * p.y};
    }
    object.texture.push_back(own);
  }
}

}  // namespace deltalux::surfaces
