// SPDX-License-Identifier: Apache-2.0
// Storage of segments in chunks that never move.
#include "segments/segment_store.h"

#include <algorithm>
#include <cmath>

namespace deltalux::segments {

ScanGrid::ScanGrid(const Box& world) {
  const Vec3f e = world.extent();
  const float side = std::max({e.x, e.y, e.z, 1e-20f});
  cells_per_metre = 1000.0f / side;
  origin = world.low - Vec3f{1, 1, 1} * (8.0f / cells_per_metre);
}

void ScanGrid::encode(Vec3f a, Vec3f b, uint32_t& centre, uint32_t& half) const {
  const Vec3f c = ((a + b) * 0.5f - origin) * cells_per_metre;
  const Vec3f h = (b - a) * (0.5f * cells_per_metre);
  const auto unsigned_cell = [](float v) {
    return uint32_t(std::min(1023.0f, std::max(0.0f, std::nearbyint(v))));
  };
  const auto signed_cell = [](float v) {
    return uint32_t(int32_t(std::min(511.0f, std::max(-511.0f, std::nearbyint(v))))) & 1023u;
  };
  centre = unsigned_cell(c.x) | unsigned_cell(c.y) << 10 | unsigned_cell(c.z) << 20;
  half = signed_cell(h.x) | signed_cell(h.y) << 10 | signed_cell(h.z) << 20;
}

void Level::allocate(size_t count, bool with_extended, std::vector<uint32_t>& out) {
  out.resize(count);
  for (uint32_t& slot : out) {
    if (!free_.empty()) {
      slot = free_.back();
      free_.pop_back();
      continue;
    }
    if (size_ % kChunk == 0) {
      chunks_.push_back(std::make_unique_for_overwrite<Chunk>());
      Chunk& chunk = *chunks_.back();
      // Unused slots of the last chunk must look unused to whoever scans whole chunks.
      for (uint32_t i = 0; i < kChunk; ++i) {
        chunk.segment[i].length = -1.0f;
        chunk.centre[i] = chunk.half[i] = 0;
      }
      if (with_extended) chunk.extended = std::make_unique<float[]>(kChunk);
    }
    slot = size_++;
  }
}

size_t Level::bytes() const {
  size_t sum = chunks_.capacity() * sizeof(void*) + free_.capacity() * sizeof(uint32_t);
  for (const auto& chunk : chunks_)
    sum += sizeof(Chunk) + (chunk->extended ? kChunk * sizeof(float) : 0);
  return sum;
}

size_t SegmentStore::live() const {
  size_t sum = 0;
  for (const Level& level : levels_) sum += level.live();
  return sum;
}

size_t SegmentStore::bytes() const {
  size_t sum = 0;
  for (const Level& level : levels_) sum += level.bytes();
  return sum;
}

void SegmentStore::index(uint32_t bounce, uint32_t slot) {
  Level::Chunk& chunk = levels_[bounce].chunk(slot);
  const uint32_t i = slot % Level::kChunk;
  const Segment& s = chunk.segment[i];
  const float reach = chunk.extended ? std::max(s.length, chunk.extended[i]) : s.length;
  grid_.encode(s.origin, s.origin + decode_direction(s.direction) * std::max(reach, 0.0f),
               chunk.centre[i], chunk.half[i]);
}

}  // namespace deltalux::segments
