// SPDX-License-Identifier: Apache-2.0
// Column by column: each is read and written in one go.
#include "segments/segment_columns.h"

#include "base/assertion.h"

namespace deltalux::segments {
namespace {

const float* SegmentSpan::* const kColumns[8] = {
    &SegmentSpan::ox, &SegmentSpan::oy, &SegmentSpan::oz,     &SegmentSpan::dx,
    &SegmentSpan::dy, &SegmentSpan::dz, &SegmentSpan::length, &SegmentSpan::extended};

}  // namespace

void SegmentColumns::add(Vec3f o, Vec3f w, float length, float extended, const uint32_t quanta[3]) {
  const float values[8] = {o.x, o.y, o.z, w.x, w.y, w.z, length, extended};
  for (int k = 0; k < 8; ++k) column[k].push_back(values[k]);
  power.insert(power.end(), quanta, quanta + 3);
}

void SegmentColumns::append(const SegmentSpan& s) {
  for (int k = 0; k < 8; ++k) {
    const float* from = s.*kColumns[k];
    column[k].insert(column[k].end(), from, from + s.count);
  }
  power.insert(power.end(), s.power, s.power + 3 * s.count);
  if (s.slab) slab.insert(slab.end(), s.slab, s.slab + s.count);
}

void SegmentColumns::assign(const SegmentColumns& from, std::span<const uint32_t> order) {
  clear();
  for (int k = 0; k < 8; ++k)
    for (uint32_t i : order) column[k].push_back(from.column[k][i]);
  for (uint32_t i : order) {
    DELTALUX_ASSERT(i < from.count());
    const uint32_t* p = from.power.data() + 3 * size_t(i);
    power.insert(power.end(), p, p + 3);
  }
  if (!from.slab.empty())
    for (uint32_t i : order) slab.push_back(from.slab[i]);
}

void SegmentColumns::clear() {
  for (std::vector<float>& own : column) own.clear();
  power.clear();
  slab.clear();
}

SegmentSpan SegmentColumns::span(size_t begin, size_t end) const {
  DELTALUX_ASSERT(begin <= end && end <= count());
  DELTALUX_ASSERT(power.size() == 3 * count() && (slab.empty() || slab.size() == count()));
  SegmentSpan out{.count = end - begin,
                  .power = power.data() + 3 * begin,
                  .slab = slab.empty() ? nullptr : slab.data() + begin};
  for (int k = 0; k < 8; ++k) out.*kColumns[k] = column[k].data() + begin;
  return out;
}

}  // namespace deltalux::segments
