// SPDX-License-Identifier: Apache-2.0
// The radius rule that measured best in rooms: noise falls with d, blur grows with d^2.
#include "samples/placement.h"

#include <cmath>

#include "base/random.h"
#include "samples/disc_area.h"

namespace deltalux::samples {

constexpr float kShareOfRoom = 0.8f;  // of the harmonic mean distance to the surroundings

float scene_metre(const scene::Scene& scene) { return 0.1f * scene.world().diagonal(); }

void resolve_radii(const scene::Scene& scene, const trace::RayCaster& caster, uint64_t paths,
                   const Workers& workers, Progress& progress, SampleSet& samples) {
  constexpr int kRays = 16;
  const float metre = scene_metre(scene);
  // Noise falls as 1 / (paths d^2), blur grows with d^4.
  const float balance = float(std::pow(1e6 / double(std::max<uint64_t>(1, paths)), 1.0 / 6));
  const float least = 0.08f * metre * balance, most = 0.2f * metre * balance;
  progress.begin("disc radii", samples.size());
  workers.for_blocks(samples.size(), 512, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i) {
      if (!std::isnan(samples.radius[i])) continue;
      if (samples.attached[i] != scene::kNone) {
        // Where a moving object's surroundings are is not fixed in time: half of the usual bound.
        samples.radius[i] = std::max(least, 0.5f * most);
        continue;
      }
      const Vec3f n = samples.normal[i];
      // As high as the highest disc: on a vertex of a concave mesh the faces around it stand up
      // from the tangent plane, and are no surroundings.
      const Vec3f above = samples.point[i] + n * caster.epsilon();
      const float room = caster.closest_static(above, n, 0.0f, 2 * kLift * most).t;
      const Vec3f origin = above + n * std::min(kLift * most, 0.5f * room);
      Vec3f u, v;
      tangent_frame(n, u, v);
      float inverse_sum = 0;
      for (int k = 0; k < kRays; ++k) {
        const float height = (float(k) + 0.5f) / kRays;
        const float turn = 6.2831853f * sobol::sample(uint32_t(k), 7)[0];
        const float flat = std::sqrt(1 - height * height);
        const Vec3f w = u * (std::cos(turn) * flat) + v * (std::sin(turn) * flat) + n * height;
        const float t = caster.closest_static(origin, w).t;
        inverse_sum += 1.0f / std::max(t, 1e-3f * metre);
      }
      const float harmonic = inverse_sum > 0 ? kRays / inverse_sum : most;
      samples.radius[i] = std::min(most, std::max(least, kShareOfRoom * harmonic));
    }
    progress.advance(end - begin);
  });
}

}  // namespace deltalux::samples
