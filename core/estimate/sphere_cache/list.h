// SPDX-License-Identifier: Apache-2.0
// Lists of segments of the sphere cache: the segments that meet a sphere, as a structure of arrays.
#pragma once
#include <memory>
#include <vector>

#include "base/vec.h"
#include "estimate/sphere_cache/kernels.h"

namespace deltalux::estimate::sphere_cache {

/// How many segments a kernel processes at a time. All give the same sums and statistics.
enum class Lanes : uint8_t {
  widest,  ///< the widest that isa() allows
  eight,
  one,  ///< scalar code, the reference for measurements
};
Kernels kernels(Lanes width);

/// Segments [0, count) meet the sphere by the exact test. The very few segments of [count, size)
/// miss it by less than the rounding error of the disc test, which could therefore find crossings
/// with a disc inside: they are tested against discs, but not counted in statistics.
class SegmentList {
 public:
  /// Reserves room for `size` segments; discards the contents if that needs new memory.
  void reserve(size_t size);
  void append(Vec3f origin, Vec3f direction, float end, uint32_t index);
  /// Assigns the segments of `from` that meet the sphere. `margin` bounds the rounding errors of
  /// all single-precision tests, in metres; `scratch` is working memory.
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
