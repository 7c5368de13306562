// SPDX-License-Identifier: Apache-2.0
// The ray lists of the sphere cache: segments that meet a sphere, as structure of arrays.
#pragma once
#include <memory>
#include <vector>

#include "base/vec.h"
#include "estimate/sphere_cache/kernels.h"

namespace deltalux::estimate::sphere_cache {

/// How many segments a kernel takes at once. All give the same sums and statistics.
enum class Lanes : uint8_t {
  widest,  ///< the most that isa() has
  eight,
  one,  ///< plain code, the reference of measurements
};
Kernels kernels(Lanes width);

/// Segments [0, count) meet the sphere by the exact test. Those of [count, size), very few, miss it
/// by less than the rounding of the disc test, which could therefore let them cross a disc inside:
/// they are tested against discs, and counted as little as if they were not there.
class SegmentList {
 public:
  /// Room for `size` segments; forgets what was in it where that takes new memory.
  void reserve(size_t size);
  void append(Vec3f origin, Vec3f direction, float end, uint32_t index);
  /// Those of `from` that meet the sphere. `margin` bounds the rounding of all float tests in
  /// metres; `scratch` is used inside.
  void assign(const SegmentList& from, Vec3f centre, double radius, double margin,
              const Kernels& kernels, std::vector<uint32_t>& scratch);

  const Columns& columns() const { return columns_; }
  Vec3f origin(size_t i) const { return {columns_.of[0][i], columns_.of[1][i], columns_.of[2][i]}; }
  Vec3f direction(size_t i) const {
    return {columns_.of[3][i], columns_.of[4][i], columns_.of[5][i]};
  }
  size_t count = 0, size = 0;

 private:
  struct alignas(64) FloatBlock {
    float place[16];
  };
  bool meets(size_t i, Vec3f centre, double radius) const;
  void copy(const SegmentList& from, size_t i);

  std::unique_ptr<FloatBlock[]> columns_memory_;
  struct alignas(64) IndexBlock {
    uint32_t place[16];
  };
  std::unique_ptr<IndexBlock[]> index_memory_;
  size_t capacity_ = 0;
  Columns columns_{};
};

}  // namespace deltalux::estimate::sphere_cache
