// SPDX-License-Identifier: Apache-2.0
// Where the paths of a large area light go: half of them towards places from which light reaches
// what is looked at, such as windows before a luminous sky.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace deltalux::trace {

/// Chosen at the bake, see plan/light_guiding.h. A light's surface is divided into parts of equal
/// power, in the order of its triangles; each part aims at balls with chances of its own.
struct AimMap {
  struct Target {
    Vec3f centre;
    float radius;
  };
  static constexpr uint32_t kParts = 64;
  static constexpr size_t kMostTargets = 63;  ///< a ball that is divided 31 times, and its parts
  static constexpr double kInside = -1;       ///< instead of a versine
  /// Share of the paths that are aimed. So no path has more than twice the mean power.
  static constexpr float kAimed = 0.5f;
  /// Random numbers are multiples of one over this, and so are the chances of pairs.
  static constexpr uint32_t kSteps = 1 << 22;

  /// What an aimed path is drawn from.
  struct Choice {
    float place;  ///< on the surface: share of the power before it
    uint32_t target;
  };
  /// `r`: random, in [0, 1). Preserves stratification.
  Choice choose(float r) const;
  /// Of aimed paths that start at `from`, which is at this place: the density over that of uniform
  /// starts, per solid angle in direction `w`. `own`: the target that was drawn, or null: its cone
  /// contains `w` whatever is rounded. `cosine_density`: that of a path that is not aimed, and of
  /// those that start within a target.
  double density(float place, Vec3f from, Vec3f w, const Target* own, double cosine_density) const;
  static float max_weight() { return 1 / (1 - kAimed); }
  /// One minus the cosine of the cone around a target: narrow cones need all digits. kInside within
  /// the ball or close to it.
  static double versine_of(const Target& target, Vec3f from);
  /// Why these data are invalid; null if they are valid.
  const char* flaw() const;

  std::vector<Target> targets;
  /// By part and target: cumulative chance of the pairs before each.
  std::vector<float> below;

 private:
  float chance(size_t pair) const {
    return (pair + 1 < below.size() ? below[pair + 1] : 1.0f) - below[pair];
  }
};

}  // namespace deltalux::trace
