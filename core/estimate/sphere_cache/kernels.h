// SPDX-License-Identifier: Apache-2.0
// The two inner loops of the sphere cache, written once for any number of lanes: which segments
// meet a sphere, and which cross a disc. `W` is local to the file that instantiates it, and nothing
// here calls an inline function that other files share, so that no code for a certain instruction
// set is linked into other files.
#pragma once
#include <cstddef>
#include <cstdint>

#include "estimate/crossing_lanes.h"

namespace deltalux::estimate::sphere_cache {

inline constexpr int kColumns = 7;   // origin, direction, end
inline constexpr size_t kRoom = 16;  // entries behind the last one that kernels may access

/// Columns are aligned to 64 bytes.
struct Columns {
  float* of[kColumns];
  uint32_t* index;  ///< index in the caller's span
};

struct SphereTest {
  float centre[3];
  /// squared distances: below `surely2` a segment certainly meets the sphere, above `maybe2` it
  /// certainly does not
  float surely2, maybe2;
};

struct DiscTest {
  float centre[3], normal[3], radius;
};

struct MeetCounts {
  size_t surely, maybe;
};

/// Packs those of the first `count` segments that certainly meet the sphere into `to`, and writes
/// the indices of those that may meet it to `maybe`.
using MeetSphere = MeetCounts (*)(const Columns& from, size_t count, const SphereTest& sphere,
                                  const Columns& to, uint32_t* maybe);
/// Writes the indices of segments that pass cross_circle() with their `end`; returns their number.
using CrossDisc = size_t (*)(const Columns& list, size_t count, const DiscTest& disc,
                             uint32_t* hits);
struct Kernels {
  MeetSphere meet_sphere;
  CrossDisc cross_disc;
};

/// Mask of the lanes below `count`.
template <class W>
uint32_t lanes_below(size_t count) {
  return count < W::kWidth ? (1u << count) - 1 : (1u << W::kWidth) - 1;
}

template <class W>
MeetCounts meet_sphere(const Columns& from, size_t count, const SphereTest& sphere,
                       const Columns& to, uint32_t* maybe) {
  using Floats = typename W::Floats;
  const Floats cx = W::broadcast(sphere.centre[0]), cy = W::broadcast(sphere.centre[1]),
               cz = W::broadcast(sphere.centre[2]), zero = W::broadcast(0.0f),
               surely2 = W::broadcast(sphere.surely2), maybe2 = W::broadcast(sphere.maybe2);
  MeetCounts found{0, 0};
  for (size_t i = 0; i < count; i += W::kWidth) {
    Floats column[kColumns];
    for (int k = 0; k < kColumns; ++k) column[k] = W::load(from.of[k] + i);
    const auto& [ox, oy, oz, wx, wy, wz, end] = column;
    const Floats vx = cx - ox, vy = cy - oy, vz = cz - oz;
    const Floats along = W::about_multiply_add(vz, wz, W::about_multiply_add(vy, wy, vx * wx));
    const Floats t = W::min(W::max(along, zero), end);
    const Floats x = W::about_less_product(vx, t, wx), y = W::about_less_product(vy, t, wy),
                 z = W::about_less_product(vz, t, wz);
    const Floats distance2 = W::about_multiply_add(z, z, W::about_multiply_add(y, y, x * x));
    const uint32_t there = lanes_below<W>(count - i);
    const uint32_t in = W::mask(W::less_equal(distance2, surely2)) & there;
    const uint32_t near = W::mask(W::less_equal(distance2, maybe2)) & there & ~in;
    for (int k = 0; k < kColumns; ++k) W::store_packed(to.of[k] + found.surely, column[k], in);
    W::store_packed(to.index + found.surely, from.index + i, in);
    found.surely += size_t(__builtin_popcount(in));
    if (near) {
      W::store_packed_sequence(maybe + found.maybe, uint32_t(i), near);
      found.maybe += size_t(__builtin_popcount(near));
    }
  }
  return found;
}

template <class W>
size_t cross_disc(const Columns& list, size_t count, const DiscTest& disc, uint32_t* hits) {
  using Floats = typename W::Floats;
  const Floats c[3] = {W::broadcast(disc.centre[0]), W::broadcast(disc.centre[1]),
                       W::broadcast(disc.centre[2])};
  const Floats n[3] = {W::broadcast(disc.normal[0]), W::broadcast(disc.normal[1]),
                       W::broadcast(disc.normal[2])};
  const Floats radius = W::broadcast(disc.radius), radius2 = radius * radius;
  size_t found = 0;
  for (size_t i = 0; i < count; i += W::kWidth) {
    Floats column[kColumns];
    for (int k = 0; k < kColumns; ++k) column[k] = W::load(list.of[k] + i);
    const uint32_t hit =
        cross_circles<W>(column, column + 3, column[6], c, n, radius2) & lanes_below<W>(count - i);
    if (!hit) continue;
    W::store_packed_sequence(hits + found, uint32_t(i), hit);
    found += size_t(__builtin_popcount(hit));
  }
  return found;
}

/// Sixteen lanes; only for processors with AVX-512.
Kernels kernels_avx512();

}  // namespace deltalux::estimate::sphere_cache
