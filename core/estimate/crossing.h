// SPDX-License-Identifier: Apache-2.0
// THE segment-disc test (SYSTEM.md section 3): every disc method calls crosses() on the same bits,
// alone or through a SIMD twin that performs the same operations in the same order. The build
// forbids contraction, so both agree to the bit.
#pragma once
#include <cmath>

#include "base/vec.h"
#include "samples/disc_set.h"
#include "segments/segment_span.h"

namespace deltalux::estimate {

/// Where a segment ends for a disc of this radius.
inline float segment_end(segments::SegmentEnd rule, float length, float extended, float radius) {
  switch (rule) {
    case segments::SegmentEnd::first:
      return length;
    case segments::SegmentEnd::second:
      return extended;
    case segments::SegmentEnd::bounded:
      break;
  }
  const float bound = length + segments::kBoundedRadii * radius;
  return bound < extended ? bound : extended;
}

/// True when (offset_u, offset_v), inside the circle, lies within a clipped disc's outline.
inline bool inside_outline(const samples::Outline& outline, float radius, float u, float v) {
  constexpr float kSectors = samples::kProbes / 6.28318530717958647692f;
  float turn = std::atan2(v, u) * kSectors;
  if (turn < 0) turn += float(samples::kProbes);
  const int k = int(turn) % samples::kProbes, next = (k + 1) % samples::kProbes;
  const float a = outline[k], b = outline[next];
  if (a >= radius && b >= radius) return true;
  constexpr float kStep = 6.28318530717958647692f / samples::kProbes;
  const float ax = a * std::cos(kStep * float(k)), ay = a * std::sin(kStep * float(k));
  const float bx = b * std::cos(kStep * float(next)), by = b * std::sin(kStep * float(next));
  return (bx - ax) * (v - ay) - (by - ay) * (u - ax) >= 0.0f;
}

/// The crossing of a segment with a disc's plane, relative to the centre.
struct Crossing {
  bool hit = false;
  Vec3f offset{};
};

/// The circle's test: s = n.(c-o)/(n.w), front side, 0 < s <= end, |o + s w - c|^2 <= d^2.
inline Crossing cross_circle(Vec3f o, Vec3f w, float end, Vec3f c, Vec3f n, float radius) {
  const float facing = n.x * w.x + n.y * w.y + n.z * w.z;
  const float height = n.x * (c.x - o.x) + n.y * (c.y - o.y) + n.z * (c.z - o.z);
  const float s = height / facing;
  const Vec3f p{(o.x + s * w.x) - c.x, (o.y + s * w.y) - c.y, (o.z + s * w.z) - c.z};
  const float distance2 = p.x * p.x + p.y * p.y + p.z * p.z;
  // Comparisons with NaN (a parallel segment in the plane) are false: no crossing.
  return {facing < 0.0f && s > 0.0f && s <= end && distance2 <= radius * radius, p};
}

/// Second stage for a circle hit: the outline of disc `i`.
inline bool within_disc(const samples::DiscSet& discs, size_t i, Vec3f offset) {
  if (discs.outline[i] == samples::kWholeDisc) return true;
  Vec3f u, v;
  tangent_frame(discs.normal[i], u, v);
  return inside_outline(discs.outlines[discs.outline[i]], discs.radius[i], dot(offset, u),
                        dot(offset, v));
}

inline Crossing crosses(const samples::DiscSet& discs, size_t i, Vec3f o, Vec3f w, float length,
                        float extended, segments::SegmentEnd rule) {
  const float end = segment_end(rule, length, extended, discs.radius[i]);
  Crossing crossing = cross_circle(o, w, end, discs.centre[i], discs.normal[i], discs.radius[i]);
  crossing.hit = crossing.hit && within_disc(discs, i, crossing.offset);
  return crossing;
}

}  // namespace deltalux::estimate
