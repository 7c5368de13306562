// SPDX-License-Identifier: Apache-2.0
// Operations on eight segments of a ray map: loading them, and finding the halves of a cell that
// they meet.
#pragma once
#include <algorithm>
#include <bit>
#include <span>
#include <vector>

#include "estimate/lanes.h"
#include "estimate/ray_map/ray_map.h"

namespace deltalux::estimate {

/// Prefetches segments that a loop over `ids` will need some iterations later.
inline void prefetch_rays(const RayRecord* records, std::span<const uint32_t> ids, size_t first) {
  constexpr size_t kAhead = 32;
  for (size_t i = first + kAhead; i < std::min(first + kAhead + 8, ids.size()); ++i)
    __builtin_prefetch(&records[ids[i]]);
}

/// Segments in SIMD lanes. Lanes beyond the end of the list repeat its last segment and are not in
/// `valid`.
template <class L>
struct RayLanes {
  typename L::Floats o[3], w[3], length, extended;
  uint32_t valid;

  RayLanes(const RayRecord* records, std::span<const uint32_t> ids, size_t first) {
    static_assert(sizeof(RayRecord) == 32);
    const size_t count = std::min<size_t>(8, ids.size() - first);
    valid = (1u << count) - 1;
    const float* row[8];
    for (size_t i = 0; i < 8; ++i) row[i] = &records[ids[first + std::min(i, count - 1)]].origin.x;
    typename L::Floats column[8];
    L::load_columns(row, column);
    std::copy_n(column, 3, o);
    std::copy_n(column + 3, 3, w);
    length = column[6], extended = column[7];
  }
};

/// A list under construction, whose memory is reused.
struct HalfList {
  std::vector<uint32_t> room;
  size_t count = 0;

  void clear(size_t most) {
    count = 0;
    if (room.size() < most + 8) room.resize(most + 8);
  }
  template <class L>
  void append(const uint32_t* eight, uint32_t mask) {
    L::store_packed(room.data() + count, eight, mask);
    count += size_t(std::popcount(mask));
  }
  std::span<const uint32_t> ids() const { return {room.data(), count}; }
};

/// Finds the segments that meet the cell's part below (above) a plane, each part grown by a margin
/// that covers all rounding errors: 64 u reach (u = 2^-24). A crossing accepted by crossing.h
/// deviates from the segment and from the disc by at most 21 u reach; the rest is for the tests
/// here.
class CellSplit {
 public:
  CellSplit(const Box& cell, int axis, float plane, float margin, segments::SegmentEnd rule,
            float radius, bool ends_only)
      : low_(cell.low), high_(cell.high), plane_(plane), margin_(margin), axis_(axis) {
    // No disc counts a segment beyond min(length + past, extended).
    using segments::SegmentEnd;
    past_ = rule == SegmentEnd::bounded ? segments::kBoundedRadii * radius
                                        : std::numeric_limits<float>::infinity();
    first_ = rule == SegmentEnd::first || ends_only;
    ends_only_ = ends_only;
  }

  /// Writes the ids that meet each half, in order. Both arrays need room for eight more than `ids`.
  void classify(const RayRecord* records, std::span<const uint32_t> ids, HalfList& below,
                HalfList& above) const {
    lanes::with([&]<class L>(L) { classify_with<L>(records, ids, below, above); });
  }

 private:
  template <class L>
  void classify_with(const RayRecord* records, std::span<const uint32_t> ids, HalfList& below,
                     HalfList& above) const {
    alignas(32) uint32_t eight[8] = {};
    for (size_t first = 0; first < ids.size(); first += 8) {
      prefetch_rays(records, ids, first);
      const RayLanes<L> rays(records, ids, first);
      std::copy_n(ids.data() + first, std::bit_width(rays.valid), eight);
      const auto [in_below, in_above] = halves(rays);
      below.append<L>(eight, in_below & rays.valid);
      above.append<L>(eight, in_above & rays.valid);
    }
  }

  struct Halves {
    uint32_t below, above;
  };
  template <class L>
  Halves halves(const RayLanes<L>& rays) const {
    using Floats = typename L::Floats;
    const Floats steepest = L::broadcast(1e30f), one = L::broadcast(1.0f);
    Floats enter = ends_only_ ? rays.length : L::broadcast(0.0f), leave = rays.length;
    if (!first_) leave = L::min(leave + L::broadcast(past_), rays.extended);
    Floats enter_below = enter, leave_below = leave, enter_above = enter, leave_above = leave;
    for (int axis = 0; axis < 3; ++axis) {
      // Clamp, so that no product is NaN; a segment so close to parallel does not leave the margin
      // within reach.
      const Floats inverse = L::max(L::min(one / rays.w[axis], steepest), L::broadcast(-1e30f));
      const auto at = [&](float plane) { return (L::broadcast(plane) - rays.o[axis]) * inverse; };
      const Floats low = at(low_[axis] - margin_), high = at(high_[axis] + margin_);
      if (axis != axis_) {
        enter = L::max(enter, L::min(low, high)), leave = L::min(leave, L::max(low, high));
        continue;
      }
      const Floats top = at(plane_ + margin_), bottom = at(plane_ - margin_);
      enter_below = L::min(low, top), leave_below = L::max(low, top);
      enter_above = L::min(bottom, high), leave_above = L::max(bottom, high);
    }
    return {L::mask(L::less_equal(L::max(enter, enter_below), L::min(leave, leave_below))),
            L::mask(L::less_equal(L::max(enter, enter_above), L::min(leave, leave_above)))};
  }

  Vec3f low_, high_;
  float plane_, margin_, past_;
  int axis_;
  bool first_, ends_only_;
};

}  // namespace deltalux::estimate
