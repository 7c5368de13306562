// SPDX-License-Identifier: Apache-2.0
// Filters lists of segments: SIMD code decides the clear cases in single precision; the few
// segments close to the sphere's surface are decided in double precision.
#include "estimate/sphere_cache/list.h"

#include "base/cpu.h"
#include "estimate/lanes.h"

namespace deltalux::estimate::sphere_cache {
namespace {

template <class L>
struct Eight : L {
  static constexpr size_t kWidth = 8;
};

struct One {
  static constexpr size_t kWidth = 1;
  using Floats = float;
  static float load(const float* p) { return *p; }
  static float broadcast(float x) { return x; }
  static float min(float a, float b) { return a < b ? a : b; }
  static float max(float a, float b) { return a > b ? a : b; }
  static float about_multiply_add(float a, float b, float c) { return a * b + c; }
  static float about_less_product(float c, float a, float b) { return c - a * b; }
  static uint32_t less(float a, float b) { return a < b; }
  static uint32_t less_equal(float a, float b) { return a <= b; }
  static uint32_t both(uint32_t a, uint32_t b) { return a & b; }
  static uint32_t mask(uint32_t flags) { return flags; }
  // Always store: a branch with random outcome takes twice as long.
  static void store_packed(float* to, float value, uint32_t) { *to = value; }
  static void store_packed(uint32_t* to, const uint32_t* value, uint32_t) { *to = *value; }
  static void store_packed_sequence(uint32_t* to, uint32_t base, uint32_t) { *to = base; }
};

}  // namespace

Kernels kernels(Lanes width) {
  if (width == Lanes::one) return {meet_sphere<One>, cross_disc<One>};
#if defined(__x86_64__)
  if (width == Lanes::widest && isa() == Isa::avx512) return kernels_avx512();
#endif
  return lanes::with(
      []<class L>(L) { return Kernels{meet_sphere<Eight<L>>, cross_disc<Eight<L>>}; });
}

void SegmentList::reserve(size_t size) {
  if (size + kRoom <= capacity_) return;
  // Use an odd number of blocks: columns a power of two apart would compete for the same cache
  // lines.
  const size_t blocks = ((size + kRoom) / 16 + 1) | 1;
  capacity_ = 16 * blocks;
  columns_memory_.reset();
  columns_memory_ = std::make_unique_for_overwrite<FloatBlock[]>(blocks * kColumns);
  index_memory_.reset();
  index_memory_ = std::make_unique_for_overwrite<IndexBlock[]>(blocks);
  for (size_t k = 0; k < kColumns; ++k) columns_.of[k] = columns_memory_[k * blocks].place;
  columns_.index = index_memory_[0].place;
}

void SegmentList::append(Vec3f origin, Vec3f direction, float end, uint32_t index) {
  for (int axis = 0; axis < 3; ++axis) {
    columns_.of[axis][size] = origin[axis];
    columns_.of[axis + 3][size] = direction[axis];
  }
  columns_.of[6][size] = end;
  columns_.index[size] = index;
  count = ++size;
}

bool SegmentList::meets(size_t i, Vec3f centre, double radius) const {
  const Vec3d between = Vec3d(centre) - Vec3d(origin(i)), w(direction(i));
  const double end = columns_.of[6][i];
  const double t = std::min(std::max(dot(between, w) / dot(w, w), 0.0), end);
  const Vec3d nearest = between - w * t;
  return dot(nearest, nearest) <= radius * radius;
}

void SegmentList::copy(const SegmentList& from, size_t i) {
  for (int k = 0; k < kColumns; ++k) columns_.of[k][size] = from.columns_.of[k][i];
  columns_.index[size++] = from.columns_.index[i];
}

void SegmentList::assign(const SegmentList& from, Vec3f centre, double radius, double margin,
                         const Kernels& kernels, std::vector<uint32_t>& scratch) {
  reserve(from.size);
  if (scratch.size() < from.count + kRoom) scratch.resize(from.count + kRoom);
  const double inner = radius - margin, outer = radius + margin;
  const SphereTest sphere{{centre.x, centre.y, centre.z},
                          inner > 0 ? float(inner * inner) : -1.0f,
                          float(outer * outer)};
  const MeetCounts found =
      kernels.meet_sphere(from.columns_, from.count, sphere, columns_, scratch.data());
  size = found.surely;
  size_t border = 0;
  for (size_t k = 0; k < found.maybe; ++k)
    if (from.meets(scratch[k], centre, radius))
      copy(from, scratch[k]);
    else
      scratch[border++] = scratch[k];
  count = size;
  for (size_t k = 0; k < border; ++k) copy(from, scratch[k]);
  for (size_t i = from.count; i < from.size; ++i)
    if (from.meets(i, centre, outer)) copy(from, i);
}

}  // namespace deltalux::estimate::sphere_cache
