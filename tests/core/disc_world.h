// SPDX-License-Identifier: Apache-2.0
// Random rooms of discs and hostile segments, and the comparison of a disc method with brute force.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "base/random.h"
#include "estimate/brute_force.h"
#include "estimate/crossing.h"

namespace deltalux::estimate {

using segments::SegmentEnd;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
inline constexpr SegmentEnd kRules[] = {SegmentEnd::first, SegmentEnd::second, SegmentEnd::bounded};

/// Draws in sequence, for tests only.
class Draw {
 public:
  explicit Draw(uint64_t seed) : seed_(seed) {}
  float unit() { return unit_float(combine(seed_, next_++)); }
  float range(float low, float high) { return low + (high - low) * unit(); }
  uint32_t below(uint32_t n) { return uint32_t(combine(seed_, next_++) % n); }
  bool chance(float p) { return unit() < p; }
  Vec3f in_cube(float half) { return {range(-half, half), range(-half, half), range(-half, half)}; }
  Vec3f direction() {
    const float z = range(-1, 1), phi = range(0, 2 * std::numbers::pi_v<float>);
    const float r = std::sqrt(std::max(0.0f, 1 - z * z));
    return {r * std::cos(phi), r * std::sin(phi), z};
  }
  Vec3f axis() {
    Vec3f a;
    a[int(below(3))] = chance(0.5f) ? 1.0f : -1.0f;
    return a;
  }

 private:
  uint64_t seed_, next_ = 0;
};

struct Segments {
  std::vector<float> ox, oy, oz, dx, dy, dz, length, extended;
  std::vector<uint32_t> power;
  std::vector<uint16_t> slab;

  void add(Vec3f o, Vec3f d, float first, float second) {
    ox.push_back(o.x), oy.push_back(o.y), oz.push_back(o.z);
    dx.push_back(d.x), dy.push_back(d.y), dz.push_back(d.z);
    length.push_back(first), extended.push_back(second);
    const uint32_t k = uint32_t(ox.size());
    power.insert(power.end(), {k, 2 * k + 1, uint32_t(mix64(k))});
    slab.push_back(uint16_t(k % 3));
  }
  size_t size() const { return ox.size(); }
  Segments select(std::span<const uint32_t> rows) const {
    Segments part;
    const auto take = [&](const auto& from, auto& to, size_t width) {
      for (const size_t row : rows)
        to.insert(to.end(), &from[width * row], &from[width * row] + width);
    };
    take(ox, part.ox, 1), take(oy, part.oy, 1), take(oz, part.oz, 1);
    take(dx, part.dx, 1), take(dy, part.dy, 1), take(dz, part.dz, 1);
    take(length, part.length, 1), take(extended, part.extended, 1);
    take(power, part.power, 3), take(slab, part.slab, 1);
    return part;
  }
  segments::SegmentSpan span(bool slabs) const {
    return {size(),
            ox.data(),
            oy.data(),
            oz.data(),
            dx.data(),
            dy.data(),
            dz.data(),
            length.data(),
            extended.data(),
            power.data(),
            slabs ? slab.data() : nullptr};
  }
};

inline void add_disc(samples::DiscSet& discs, Vec3f centre, Vec3f normal, float radius) {
  discs.centre.push_back(centre);
  discs.normal.push_back(normal);
  discs.radius.push_back(radius);
  discs.outline.push_back(samples::kWholeDisc);
  discs.id.push_back(uint32_t(discs.id.size()));
}

inline void clip_some(samples::DiscSet& discs, Draw& draw, float share) {
  for (size_t k = 0; k < discs.size(); ++k) {
    if (!draw.chance(share)) continue;
    discs.outline[k] = uint32_t(discs.outlines.size());
    samples::Outline& outline = discs.outlines.emplace_back();
    for (float& r : outline) r = discs.radius[k] * std::min(1.0f, draw.range(0.0f, 2.0f));
  }
}

/// Discs on the walls of a room, on balls and in mid-air; about `radius` wide.
inline samples::DiscSet room(Draw& draw, size_t count, float half, float radius, Vec3f offset) {
  samples::DiscSet discs;
  for (size_t k = 0; k < count; ++k) {
    Vec3f n = draw.direction(), c = draw.in_cube(half);
    const float r = radius * draw.range(0.5f, 1.5f);
    switch (draw.below(4)) {
      case 0:
      case 1: {
        n = draw.axis();
        for (int axis = 0; axis < 3; ++axis)
          if (n[axis] != 0) c[axis] = -half * n[axis];
        break;
      }
      case 2:
        c = n * (0.5f * half);
        break;
      default:
        break;
    }
    add_disc(discs, c + offset, n, r);
  }
  return discs;
}

/// Segments that meet discs, end on them, graze them or lie in their planes, and oddities. Those
/// that start or end `far` away can make a method test every pair.
inline Segments hostile_segments(Draw& draw, const samples::DiscSet& discs, size_t count,
                                 float half, Vec3f offset, bool far = true) {
  Segments s;
  while (s.size() < count) {
    Vec3f o = draw.in_cube(half) + offset, d = draw.direction();
    float first = draw.range(0, 2 * half), second = first + draw.range(0, half);
    if (discs.size() > 0 && draw.chance(0.7f)) {
      const uint32_t k = draw.below(uint32_t(discs.size()));
      const Vec3f c = discs.centre[k], n = discs.normal[k];
      Vec3f u, v;
      tangent_frame(n, u, v);
      const float phi = draw.range(0, 7),
                  r = discs.radius[k] * (draw.chance(0.3f) ? 1.0f : draw.unit());
      const Vec3f p = c + u * (r * std::cos(phi)) + v * (r * std::sin(phi));
      if (draw.chance(0.3f)) o = p + u * draw.range(-half, half);  // in its plane
      if (draw.chance(0.2f)) o = p;                                // starts on it
      if (draw.chance(0.2f)) o = p + n * (1e-5f * half);           // just above
      if (draw.chance(0.1f)) o = {p.x, o.y, o.z};
      const Vec3f way = p - o;
      if (length(way) > 0) {
        first = length(way);
        d = way * (1 / first);
        second = first + draw.range(0, half);
        if (draw.chance(0.3f)) first *= 1 + 1e-6f * draw.range(-1, 1);  // ends about there
      }
    }
    if (draw.chance(0.1f)) d = draw.axis();
    if (draw.chance(0.05f)) d.x = -0.0f;
    if (draw.chance(0.05f)) d.y = 1e-30f;
    if (draw.chance(0.05f)) d = d * draw.range(0.1f, far ? 30.0f : 1.0f);
    if (draw.chance(0.01f)) d = d * (draw.chance(0.5f) ? 1e-12f : 1e12f);
    if (draw.chance(0.03f)) first = 0;
    if (draw.chance(0.05f)) second = kInfinity;
    if (draw.chance(0.05f)) first = second = kInfinity;
    if (draw.chance(0.05f)) second = first;
    if (draw.chance(0.01f)) first = kNaN;
    if (draw.chance(0.01f)) second = kNaN;
    if (draw.chance(0.01f)) d = {};
    if (draw.chance(0.01f)) d.z = kNaN;
    if (draw.chance(0.01f)) o.y = draw.chance(0.5f) ? kNaN : kInfinity;
    if (draw.chance(0.01f) && far) o = o * 1e20f;
    if (draw.chance(0.01f)) o = d = {kNaN, kNaN, kNaN};
    s.add(o, d, first, second);
  }
  return s;
}

struct World {
  samples::DiscSet discs;
  Segments segments;
};

/// A room of any size, anywhere; in half of them some discs are clipped.
inline World any_room(uint64_t seed, float most_discs) {
  Draw draw(seed);
  const float half = std::pow(10.0f, draw.range(-3, 3));
  const size_t count = size_t(std::pow(most_discs, draw.unit()));
  const Vec3f offset = draw.chance(0.5f) ? Vec3f{} : draw.in_cube(20 * half);
  const float radius = half * std::min(0.7f, 1.2f / std::sqrt(float(count)));
  World world{room(draw, count, half, radius, offset), {}};
  clip_some(world.discs, draw, draw.chance(0.5f) ? 0.3f : 0.0f);
  world.segments = hostile_segments(draw, world.discs, 1500, half, offset, seed % 4 < 2);
  return world;
}

/// Coordinates so large that discs are only a few units in the last place wide: every rounding of
/// the crossing shows, and the margins of boxes and lists have to cover it.
inline World coarse_room(uint64_t seed) {
  Draw draw(seed);
  const Vec3f offset = draw.in_cube(1e5f);
  World world{room(draw, 800, 20, 0.02f * draw.range(0.5f, 4), offset), {}};
  world.segments = hostile_segments(draw, world.discs, 2000, 20, offset);
  return world;
}

/// A room where some discs have no, long or very short normals, or no radius.
inline World degenerate_room(uint64_t seed) {
  Draw draw(seed);
  World world{room(draw, 60, 1, 0.2f, {}), {}};
  samples::DiscSet& discs = world.discs;
  for (size_t k = 0; k < discs.size(); ++k) {
    if (k % 5 == 0) discs.normal[k] = {};
    if (k % 5 == 1) discs.radius[k] = 0;
    if (k % 5 == 2) discs.normal[k] = discs.normal[k] * draw.range(1e-3f, 1e3f);
    if (k % 5 == 3) discs.normal[k] = {0, 0, 7e-45f};
  }
  world.segments = hostile_segments(draw, discs, 800, 1, {});
  return world;
}

inline void sort_slots(std::vector<HitSlots>& slots) {
  for (HitSlots& slot : slots)
    if (slot.disc[0] > slot.disc[1]) std::swap(slot.disc[0], slot.disc[1]);
}

/// Sums, moments, slots and hits equal brute force's, and removal undoes addition. Returns the
/// number of hits. Moments want unit normals and a radius.
inline uint64_t expect_same(const SignedEstimator& method, const Segments& s, SegmentEnd rule,
                            bool slabs = false, bool with_moments = true) {
  const samples::DiscSet& discs = method.discs();
  const BruteForce oracle(discs, rule);
  uint32_t ids = 1;
  for (const uint32_t id : discs.id) ids = std::max(ids, id + 1);
  std::vector<int64_t> expected(9 * ids), found(9 * ids), quiet(9 * ids);
  std::vector<HitSlots> expected_slots(s.size()), slots(s.size(), HitSlots{{7, 7}});
  std::vector<int64_t> expected_moments(18 * ids), moments(18 * ids);
  const auto given = [&](std::vector<int64_t>& m) { return with_moments ? m.data() : nullptr; };
  const auto a =
      oracle.accumulate(s.span(slabs), 1, {expected.data(), ids, true, given(expected_moments)},
                        expected_slots.data());
  const auto b =
      method.accumulate(s.span(slabs), 1, {found.data(), ids, true, given(moments)}, slots.data());
  method.accumulate(s.span(slabs), 1, {quiet.data(), ids, false});
  EXPECT_EQ(a.hits, b.hits);
  EXPECT_EQ(expected, found);
  EXPECT_EQ(expected, quiet);
  EXPECT_EQ(expected_moments, moments);
  sort_slots(expected_slots), sort_slots(slots);
  for (size_t i = 0; i < s.size(); ++i)
    for (int place = 0; place < 2; ++place)
      EXPECT_EQ(expected_slots[i].disc[place], slots[i].disc[place]) << "segment " << i;
  method.accumulate(s.span(slabs), -1, {found.data(), ids});
  EXPECT_EQ(found, std::vector<int64_t>(9 * ids)) << "removal must undo addition";
  return a.hits;
}

}  // namespace deltalux::estimate
