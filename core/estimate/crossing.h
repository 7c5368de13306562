// SPDX-License-Identifier: Apache-2.0
// THE segment-disc test (paper 2.1). Every disc method calls crosses() on the same bits, directly
// or through a SIMD twin that performs the same operations in the same order. The build forbids
// contraction to FMA, so that both agree to the bit.
#pragma once
#include <cmath>

#include "base/vec.h"
#include "samples/disc_set.h"
#include "segments/segment_span.h"

namespace deltalux::estimate {

/// The distance at which a segment ends for a disc of this radius.
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

/// Cosines and sines of the probes' angles, the same on every machine and exactly symmetric.
struct ProbeDirections {
  float cosine[samples::kProbes], sine[samples::kProbes];
};
inline constexpr ProbeDirections kProbeDirections = [] {
  static_assert(samples::kProbes == 32);
  constexpr float kQuarter[] = {1.0f,         0.980785280f, 0.923879533f,
                                0.831469612f, 0.707106781f, 0.555570233f,
                                0.382683432f, 0.195090322f, 0.0f};  // cos(k pi/16)
  ProbeDirections table{};
  for (int k = 0; k < 32; ++k) {
    const int in_half = k % 16;
    const float c = in_half <= 8 ? kQuarter[in_half] : -kQuarter[16 - in_half];
    const float s = in_half <= 8 ? kQuarter[8 - in_half] : kQuarter[in_half - 8];
    table.cosine[k] = k < 16 ? c : -c;
    table.sine[k] = k < 16 ? s : -s;
  }
  return table;
}();

/// The sector of (u, v): the k with angle(probe k) <= angle(u, v) <= angle(probe k + 1). Uses
/// comparisons within an octant and mirror images: several times faster than atan2, which took most
/// of the time of testing a clipped disc.
inline int sector_of(float u, float v) {
  const float au = std::fabs(u), av = std::fabs(v);
  const float small = std::min(au, av), large = std::max(au, av);
  int k = int(small > 0.198912367f * large) + int(small > 0.414213562f * large) +
          int(small > 0.668178638f * large);  // tan(k pi/16)
  if (av > au) k = 7 - k;
  if (u < 0) k = 15 - k;
  return v < 0 ? 31 - k : k;
}

/// True when (u, v), inside the circle and in sector k, lies within a clipped disc's outline.
inline bool inside_sector(const samples::Outline& outline, int k, float radius, float u, float v) {
  const int next = (k + 1) % samples::kProbes;
  const float a = outline[k], b = outline[next];
  if (a >= radius && b >= radius) return true;
  const float ax = a * kProbeDirections.cosine[k], ay = a * kProbeDirections.sine[k];
  const float bx = b * kProbeDirections.cosine[next], by = b * kProbeDirections.sine[next];
  // Strict, so that nothing is inside where both probes are 0.
  return (bx - ax) * (v - ay) - (by - ay) * (u - ax) > 0.0f;
}

/// Where a segment crosses a disc's plane, relative to the disc's centre.
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

/// A hit on the circle in the disc's own coordinates, with the sector that it lies in: computed
/// before the outline is read from memory.
struct InDisc {
  float u, v;
  int sector;
};
inline InDisc in_disc(Vec3f normal, Vec3f offset) {
  Vec3f u, v;
  tangent_frame(normal, u, v);
  const float x = dot(offset, u), y = dot(offset, v);
  return {x, y, sector_of(x, y)};
}

/// Second stage, after a hit on the circle of a clipped disc `i`: tests its outline.
inline bool within_outline(const samples::DiscSet& discs, size_t i, const InDisc& at) {
  return inside_sector(discs.outlines[discs.outline[i]], at.sector, discs.radius[i], at.u, at.v);
}

/// First stage for disc `i`: tests its circle.
inline Crossing crosses_circle(const samples::DiscSet& discs, size_t i, Vec3f o, Vec3f w,
                               float length, float extended, segments::SegmentEnd rule) {
  const float end = segment_end(rule, length, extended, discs.radius[i]);
  return cross_circle(o, w, end, discs.centre[i], discs.normal[i], discs.radius[i]);
}

/// Both stages.
inline Crossing crosses(const samples::DiscSet& discs, size_t i, Vec3f o, Vec3f w, float length,
                        float extended, segments::SegmentEnd rule) {
  Crossing crossing = crosses_circle(discs, i, o, w, length, extended, rule);
  if (crossing.hit && discs.outline[i] != samples::kWholeDisc)
    crossing.hit = within_outline(discs, i, in_disc(discs.normal[i], crossing.offset));
  return crossing;
}

}  // namespace deltalux::estimate
