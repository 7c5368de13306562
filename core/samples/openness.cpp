// SPDX-License-Identifier: Apache-2.0
// Estimates ambient light by short random walks, with the same random numbers at every point.
#include "samples/openness.h"

#include <cmath>
#include <numbers>

#include "base/random.h"
#include "samples/disc_area.h"
#include "trace/scatter.h"

namespace deltalux::samples {
namespace {

constexpr int kBounces = 5;
constexpr int kWalks = 192;   // from a sample, and from all points of its disc together
constexpr int kPerPoint = 2;  // walks per point of a disc
constexpr int kLook = 32;     // walks of a first test of how open a sample is
constexpr float kOpen = 0.8f;
constexpr float kFar = 5.0f;  // radii: everything farther away belongs to the surroundings
// reflectance of nearby surfaces, relative to that of the surroundings
constexpr float kReflectance = 0.7f;

/// Cosine-distributed directions around +z for every walk and bounce.
struct Directions {
  std::array<std::array<Vec3f, kBounces>, kWalks> at;
  Directions() {
    for (int walk = 0; walk < kWalks; ++walk)
      for (int bounce = 0; bounce < kBounces; ++bounce) {
        const auto r = sobol::sample(uint32_t(walk), uint64_t(bounce));
        const float turn = 2 * std::numbers::pi_v<float> * r[1], flat = std::sqrt(r[0]);
        at[walk][bounce] = {flat * std::cos(turn), flat * std::sin(turn), std::sqrt(1 - r[0])};
      }
  }
};

/// Ambient light at points of the static scene.
class Surroundings {
 public:
  Surroundings(const scene::Scene& scene, const trace::RayCaster& caster, float radius)
      : scene_(scene), caster_(caster), far_(kFar * radius) {}

  /// Sum over the walks first to first + count - 1 from `at`.
  float arrives(Vec3f at, Vec3f normal, int first, int count) const {
    float sum = 0;
    for (int walk = first; walk < first + count; ++walk) sum += arrives(at, normal, walk);
    return sum;
  }

 private:
  float arrives(Vec3f at, Vec3f normal, int walk) const {
    static const Directions directions;
    float share = 1;
    for (const Vec3f& local : directions.at[walk]) {
      const Vec3f w = turned(local, normal);
      const trace::Hit hit = caster_.closest_static(at, w, 0.0f, far_);
      if (!hit.valid()) return share;
      const Vec3f emission = scene_.material_of(hit.primitive).emission;
      if (emission.x + emission.y + emission.z > 0) return share;
      share *= kReflectance;
      normal = trace::facing_normal(hit, w);
      at = trace::leave_surface(at, w, hit, normal, scene_.slack_of(hit.primitive));
    }
    return 0;
  }

  const scene::Scene& scene_;
  const trace::RayCaster& caster_;
  float far_;
};

}  // namespace

float relative_openness(const scene::Scene& scene, const trace::RayCaster& caster, Vec3f centre,
                        Vec3f normal, float radius, const Outline& outline) {
  const Surroundings around(scene, caster, radius);
  const float look = around.arrives(centre, normal, 0, kLook);
  if (look >= kOpen * kLook) return 1;
  const DiscPoints points(normal, radius, outline);
  const auto disc = [&](int walks, int each) {
    float sum = 0;
    for (int walk = 0; walk < walks; walk += each) {
      const auto r = sobol::sample(uint32_t(walk), kBounces);
      sum += around.arrives(centre + points(r[0], r[1], r[2]), normal, walk, each);
    }
    return sum;
  };
  if (look == 0 && disc(kLook, 1) == 0) return 1;  // enclosed completely, as many samples are
  const float here = look + around.arrives(centre, normal, kLook, kWalks - kLook);
  const float there = disc(kWalks, kPerPoint);
  return there > 0 ? here / there : 1.0f;
}

void find_openness(const DiscSet& discs, size_t first, size_t last, const scene::Scene& scene,
                   const trace::RayCaster& caster, const Workers& workers, Progress& progress,
                   std::span<float> openness) {
  std::vector<uint32_t> wanted;
  for (uint32_t i = 0; i < discs.size(); ++i)
    if (first <= discs.id[i] && discs.id[i] < last) wanted.push_back(i);
  progress.begin("openness", wanted.size());
  constexpr size_t kBlock = 64;  // takes a few milliseconds between two checks for cancellation
  workers.for_blocks(wanted.size(), kBlock, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t k = begin; k < end; ++k) {
      const uint32_t i = wanted[k];
      const float radius = discs.radius[i];
      Outline outline;
      if (discs.outline[i] == kWholeDisc)
        outline.fill(radius);
      else
        outline = discs.outlines[discs.outline[i]];
      openness[discs.id[i]] =
          relative_openness(scene, caster, discs.centre[i], discs.normal[i], radius, outline);
    }
    progress.advance(end - begin);
  });
}

}  // namespace deltalux::samples
