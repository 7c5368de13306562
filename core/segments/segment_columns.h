// SPDX-License-Identifier: Apache-2.0
// Segments as columns that own their memory: what is collected for estimators, or comes from a
// user.
#pragma once
#include <span>
#include <vector>

#include "base/vec.h"
#include "segments/segment_span.h"

namespace deltalux::segments {

struct SegmentColumns {
  std::vector<float> column[8];  ///< origin, direction, length, extended, as in SegmentSpan
  std::vector<uint32_t> power;   ///< 3 per segment
  std::vector<uint16_t> slab;    ///< empty: slab 0 for all

  size_t count() const { return column[0].size(); }
  /// Its slab, where there are slabs, is the caller's to add.
  void add(Vec3f origin, Vec3f direction, float length, float extended, const uint32_t quanta[3]);
  void append(const SegmentSpan& segments);
  /// Those of `from` in that order, instead of what was here.
  void assign(const SegmentColumns& from, std::span<const uint32_t> order);
  void clear();
  SegmentSpan span() const { return span(0, count()); }
  SegmentSpan span(size_t begin, size_t end) const;
};

}  // namespace deltalux::segments
