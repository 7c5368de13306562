// SPDX-License-Identifier: Apache-2.0
// Cones of directions.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/vec.h"

namespace deltalux {

/// A cone of all directions within an angle of at most 90 degrees about a unit axis.
struct Cone {
  Vec3f axis;
  float cosine, sine;  ///< of the half angle

  /// Whether a direction of the cone may meet the ball; false only if none does.
  bool may_meet(Vec3f to_centre, float radius) const {
    const float distance = length(to_centre);
    if (!(distance > radius)) return true;
    const float ball_sine = radius / distance;
    const float ball_cosine = std::sqrt(std::max(0.0f, 1 - ball_sine * ball_sine));
    return dot(axis, to_centre) >= distance * limit(ball_cosine, ball_sine);
  }
  /// Cosine of the angle between the axes of two cones that touch, minus a small margin.
  float limit(float other_cosine, float other_sine) const {
    return cosine * other_cosine - sine * other_sine - kMargin;
  }
  static constexpr float kMargin = 1e-4f;
};

inline float sine_of(float cosine) { return std::sqrt(std::max(0.0f, 1.0f - cosine * cosine)); }

/// The direction at the given angle to the unit `axis`; `turn`: fraction of a turn around it.
inline Vec3f on_cone(Vec3f axis, float cosine, float sine, float turn) {
  Vec3f u, v;
  tangent_frame(axis, u, v);
  const float phi = 2.0f * std::numbers::pi_v<float> * turn;
  return u * (std::cos(phi) * sine) + v * (std::sin(phi) * sine) + axis * cosine;
}

}  // namespace deltalux
