// SPDX-License-Identifier: Apache-2.0
// Stores segments in chunks, which never move in memory.
#include "segments/segment_store.h"

#include <algorithm>
#include <cmath>

#include "base/assertion.h"

namespace deltalux::segments {

ScanGrid::ScanGrid(const Box& world) {
  constexpr float kMargin = 4;  // cells beyond the world
  const Vec3f extent = world.extent();
  const float side = std::max({extent.x, extent.y, extent.z, 1e-20f});
  float scale[3], corner[3];
  for (int axis = 0; axis < 3; ++axis) {
    scale[axis] = (kCells[axis] - 2 * kMargin) / std::max(extent[axis], 1e-3f * side);
    corner[axis] = world.low[axis] - kMargin / scale[axis];
  }
  cells_per_metre = {scale[0], scale[1], scale[2]};
  origin = {corner[0], corner[1], corner[2]};
}

Vec3f ScanGrid::to_cells(Vec3f p) const {
  const Vec3f d = p - origin;
  return {d.x * cells_per_metre.x, d.y * cells_per_metre.y, d.z * cells_per_metre.z};
}

uint32_t ScanGrid::pack(Vec3f cells) {
  const auto whole = [&](int axis) {
    return uint32_t(std::min(kCells[axis], std::max(0.0f, std::nearbyint(cells[axis]))));
  };
  return whole(0) | whole(2) << 11 | whole(1) << 22;
}

CellBox ScanGrid::cell_box(Vec3f a, Vec3f b) const {
  const Vec3f p = to_cells(a), q = to_cells(b);
  DELTALUX_ASSERT(std::isfinite(p.x + p.y + p.z) && std::isfinite(q.x + q.y + q.z));
  const bool rises = p.x <= q.x;
  CellBox out{pack(min(p, q)), pack(max(p, q)) | kGuards};
  if ((p.z <= q.z) != rises) out.low |= kFallsInZ;
  if ((p.y <= q.y) != rises) out.low |= kFallsInY;
  return out;
}

void BounceSegments::allocate(size_t count, const Extras& extras, std::vector<uint32_t>& out) {
  out.resize(count);
  for (uint32_t& slot : out) {
    if (!free_.empty()) {
      slot = free_.back();
      free_.pop_back();
      DELTALUX_ASSERT(at(slot).length < 0);
      continue;
    }
    if (size_ % kChunk == 0) {
      chunks_.push_back(std::make_unique_for_overwrite<Chunk>());
      Chunk& chunk = *chunks_.back();
      // Slots that are not used yet must look unused when whole chunks are scanned.
      for (uint32_t i = 0; i < kChunk; ++i) {
        chunk.segment[i].length = -1.0f;
        chunk.low[i] = ScanGrid::kUnused.low;
        chunk.high[i] = ScanGrid::kUnused.high;
      }
      if (extras.extended) chunk.extended = std::make_unique<float[]>(kChunk);
      if (extras.landing) chunk.landing = std::make_unique<uint32_t[]>(kChunk);
      if (extras.history) chunk.history = std::make_unique<LightHistory[]>(kChunk);
    }
    DELTALUX_ASSERT(size_ < kNoSlot);
    slot = size_++;
  }
}

size_t BounceSegments::bytes() const {
  // All chunks have the same arrays; do not iterate, since this is called in every update.
  const bool extended = !chunks_.empty() && chunks_.front()->extended;
  const bool landing = !chunks_.empty() && chunks_.front()->landing;
  const bool history = !chunks_.empty() && chunks_.front()->history;
  return chunks_.capacity() * sizeof(void*) + free_.capacity() * sizeof(uint32_t) +
         chunks_.size() * (sizeof(Chunk) + (extended ? kChunk * sizeof(float) : 0) +
                           (landing ? kChunk * sizeof(uint32_t) : 0) +
                           (history ? kChunk * sizeof(LightHistory) : 0));
}

size_t SegmentStore::live() const {
  size_t sum = 0;
  for (const BounceSegments& stored : bounces_) sum += stored.live();
  return sum;
}

size_t SegmentStore::bytes() const {
  size_t sum = 0;
  for (const BounceSegments& stored : bounces_) sum += stored.bytes();
  return sum;
}

void SegmentStore::index(uint32_t bounce, uint32_t slot) {
  DELTALUX_ASSERT(bounce < bounces_.size());
  const BounceSegments::Chunk& chunk = bounces_[bounce].chunk(slot);
  const uint32_t i = slot % BounceSegments::kChunk;
  const Segment& s = chunk.segment[i];
  const float reach = chunk.extended ? std::max(s.length, chunk.extended[i]) : s.length;
  bounces_[bounce].set_cell_box(
      slot,
      grid_.cell_box(s.origin, s.origin + decode_direction(s.direction) * std::max(reach, 0.0f)));
}

}  // namespace deltalux::segments
