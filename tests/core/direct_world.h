// SPDX-License-Identifier: Apache-2.0
// Small scenes for the tests of direct light.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "direct/direct_light.h"

namespace deltalux::direct {

inline constexpr double kQuantum = 0x1p-40;

inline void add_quad(scene::Object& object, Vec3f corner, Vec3f u, Vec3f v, uint32_t material = 0,
                     int pieces = 1, uint32_t group = 0) {
  for (int i = 0; i < pieces; ++i)
    for (int j = 0; j < pieces; ++j) {
      const Vec3f du = u * (1.0f / float(pieces)), dv = v * (1.0f / float(pieces));
      const Vec3f p = corner + du * float(i) + dv * float(j);
      const uint32_t base = uint32_t(object.vertices.size());
      object.vertices.insert(object.vertices.end(), {p, p + du, p + du + dv, p + dv});
      object.triangles.insert(object.triangles.end(),
                              {{base, base + 1, base + 2}, {base, base + 2, base + 3}});
      object.material.insert(object.material.end(), 2, material);
      object.group.insert(object.group.end(), 2, group);
    }
}

inline void add_box(scene::Object& object, Vec3f low, Vec3f high) {
  const Vec3f e = high - low, x{e.x, 0, 0}, y{0, e.y, 0}, z{0, 0, e.z};
  add_quad(object, low, x, z);
  add_quad(object, low, z, y);
  add_quad(object, low, y, x);
  add_quad(object, low + y, z, x);
  add_quad(object, low + x, y, z);
  add_quad(object, low + z, x, y);
}

/// A scene with its lights, all of them done by shadow rays. Material 1 emits (10, 8, 6), material
/// 2 the same from both sides.
struct World {
  scene::Scene scene;
  Progress progress;
  std::unique_ptr<trace::RayCaster> caster;
  std::vector<trace::Light> lights;
  std::vector<uint8_t> sampled;
  std::vector<Receiver> receivers;

  World() {
    scene.materials = {
        {{0.5f, 0.5f, 0.5f}, {}, false}, {{}, {10, 8, 6}, false}, {{}, {10, 8, 6}, true}};
  }
  void finish() {
    scene.finish();
    caster = std::make_unique<trace::RayCaster>(scene, progress);
    lights = trace::find_lights(scene);
    sampled.assign(lights.size(), 1);
  }
  Context context() const { return {*caster, lights, sampled, receivers}; }
  DirectLight compute(int threads = 1, uint64_t seed = 1) {
    DirectLight direct(receivers.size(), {kQuantum}, seed);
    direct.compute(context(), Workers(threads), progress);
    return direct;
  }
  /// Of light group 0.
  double irradiance(const DirectLight& direct, size_t sample, int channel = 0) const {
    const size_t samples = receivers.size();
    double sum = 0;
    for (size_t part = 0; part < direct.parts().size(); ++part)
      if (const auto& [group, quantum] = direct.parts()[part]; group == 0)
        sum += quantum * double(direct.sums()[3 * (part * samples + sample) + size_t(channel)]);
    return sum;
  }
};

}  // namespace deltalux::direct
