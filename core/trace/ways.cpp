// SPDX-License-Identifier: Apache-2.0
// Tests ways against boxes without branches, so that the compiler uses SIMD.
#include "trace/ways.h"

#include <cmath>

namespace deltalux::trace {
namespace {

float lower(float a, float b) { return a < b ? a : b; }
float upper(float a, float b) { return a > b ? a : b; }

constexpr float kTiny = 1e-30f;  // its inverse is finite, so that nothing is 0 times infinity

/// Where ways that take one step along an axis are between two planes, in units of their lengths.
struct Between {
  float enter, leave;
  Between(float step, float low, float high) {
    const float inverse = 1.0f / (step + std::copysign(kTiny, step));
    const float a = low * inverse, b = high * inverse;
    enter = lower(a, b), leave = upper(a, b);
  }
};

}  // namespace

void Ways::mark_meeting(std::span<const Box> boxes, Vec3f from) {
  const float *x = x_.data(), *y = y_.data(), *z = z_.data(), *radius = radius_.data();
  uint32_t* const marks = marks_.data();
  const size_t count = size();
  for (const Box& box : boxes) {
    if (box.empty()) continue;
    const Vec3f low = box.low - from, high = box.high - from;
    for (size_t i = 0; i < count; ++i) {
      const float own = radius[i] + 4 * kTiny;  // ways within a face meet the box
      const Between in_x(x[i] - from.x, low.x - own, high.x + own);
      const Between in_y(y[i] - from.y, low.y - own, high.y + own);
      const Between in_z(z[i] - from.z, low.z - own, high.z + own);
      const float enter = upper(upper(0.0f, in_x.enter), upper(in_y.enter, in_z.enter));
      const float leave = lower(lower(1.0f, in_x.leave), lower(in_y.leave, in_z.leave));
      marks[i] |= enter <= leave;
    }
  }
}

}  // namespace deltalux::trace
