// SPDX-License-Identifier: Apache-2.0
// All segments of all paths, by bounce. A segment is found by (bounce, slot) and knows the slot of
// its successor one bounce later. Growth never moves anything; freed slots are used again.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "base/direction.h"
#include "base/vec.h"
#include "scene/scene.h"
#include "segments/hit_slots.h"

namespace deltalux::segments {

inline constexpr uint32_t kNoSlot = 0xffffffffu;

/// One straight flight. An array of these, not a structure of arrays: an update touches few
/// segments at random, and one record is one cache line.
struct Segment {
  Vec3f origin;
  uint32_t direction;  ///< decode_direction(); the ray was traced along the decoded vector
  float length;        ///< to the first hit, or to the world's border; negative = slot not in use
  uint32_t power[3];   ///< quanta per channel
  uint32_t path;
  uint32_t primitive;  ///< first hit, or scene::kNone
  uint32_t next;       ///< slot one bounce later, or kNoSlot
};
static_assert(sizeof(Segment) == 44);

/// What a slot holds that is not in use. At bounce 0 slots are paths, used or not.
inline Segment unused_segment(uint32_t path = 0) {
  return {{}, 0, -1.0f, {0, 0, 0}, path, scene::kNone, kNoSlot};
}

/// CellBox of a segment for the scan: its box on a grid over the world, ends rounded to cells, and
/// which of the box's four diagonals it is. Fields (bit 0: x, bit 11: z, bit 22: y) are followed by
/// a guard bit each, so that one subtraction compares three of them: low <= high in every field
/// exactly if (high | kGuards) - low keeps the guards. The guards of `high` are set; those of `low`
/// carry the diagonal.
struct CellBox {
  uint32_t low, high;
};

struct ScanGrid {
  static constexpr uint32_t kGuards = 1u << 10 | 1u << 21 | 1u << 31;
  static constexpr uint32_t kFallsInZ = 1u << 10, kFallsInY = 1u << 21;  // in `low`, while x rises
  static constexpr float kCells[3] = {1023, 511, 1023};
  /// Of a slot that is not in use; no box meets it but the whole world.
  static constexpr CellBox kUnused{~kGuards, kGuards};

  Vec3f origin{}, cells_per_metre{1, 1, 1};

  ScanGrid() = default;
  explicit ScanGrid(const Box& world);
  /// Whole cells, each axis at its place.
  static uint32_t pack(Vec3f cells);
  Vec3f to_cells(Vec3f p) const;
  CellBox cell_box(Vec3f a, Vec3f b) const;
};

/// What sessions keep of each segment besides the segment itself.
struct Extras {
  bool extended = false;  ///< distance to the second hit
  bool landing = false;   ///< the cell where it ends, see gather/cells.h
};

/// One bounce of all paths.
class BounceSegments {
 public:
  static constexpr uint32_t kChunk = 2048;
  struct Chunk {
    Segment segment[kChunk];
    uint32_t low[kChunk], high[kChunk];  ///< cell boxes
    HitSlots slots[kChunk];
    std::unique_ptr<float[]> extended;    ///< see Extras
    std::unique_ptr<uint32_t[]> landing;  ///< see Extras
  };

  /// Slots ever used; some may be free.
  uint32_t size() const { return size_; }
  size_t live() const { return size_ - free_.size(); }
  Segment& at(uint32_t slot) { return chunk(slot).segment[slot % kChunk]; }
  const Segment& at(uint32_t slot) const { return chunk(slot).segment[slot % kChunk]; }
  HitSlots& slots(uint32_t slot) { return chunk(slot).slots[slot % kChunk]; }
  float& extended(uint32_t slot) { return chunk(slot).extended[slot % kChunk]; }
  uint32_t& landing(uint32_t slot) { return chunk(slot).landing[slot % kChunk]; }
  float extended_or_length(uint32_t slot) const {
    const Chunk& c = chunk(slot);
    return c.extended ? c.extended[slot % kChunk] : c.segment[slot % kChunk].length;
  }
  void set_cell_box(uint32_t slot, CellBox box) {
    Chunk& c = chunk(slot);
    c.low[slot % kChunk] = box.low;
    c.high[slot % kChunk] = box.high;
  }
  Chunk& chunk(uint32_t slot) { return *chunks_[slot / kChunk]; }
  const Chunk& chunk(uint32_t slot) const { return *chunks_[slot / kChunk]; }

  /// Slots for `count` new segments: freed ones first. Not thread-safe.
  void allocate(size_t count, const Extras& extras, std::vector<uint32_t>& out);
  /// Not thread-safe. The caller has marked the segment unused.
  void release(uint32_t slot) { free_.push_back(slot); }
  size_t bytes() const;

 private:
  std::vector<std::unique_ptr<Chunk>> chunks_;
  std::vector<uint32_t> free_;
  uint32_t size_ = 0;
};

class SegmentStore {
 public:
  SegmentStore() = default;
  SegmentStore(const Box& world, const Extras& extras) : grid_(world), extras_(extras) {}

  const ScanGrid& grid() const { return grid_; }
  const Extras& extras() const { return extras_; }
  bool with_extended() const { return extras_.extended; }
  std::vector<BounceSegments>& bounces() { return bounces_; }
  const std::vector<BounceSegments>& bounces() const { return bounces_; }
  BounceSegments& bounce(size_t bounce) {
    if (bounces_.size() <= bounce) bounces_.resize(bounce + 1);
    return bounces_[bounce];
  }
  size_t live() const;
  size_t bytes() const;
  /// Renews the scan record of a segment from its origin, direction and reach.
  void index(uint32_t bounce, uint32_t slot);

 private:
  ScanGrid grid_;
  Extras extras_;
  std::vector<BounceSegments> bounces_;
};

}  // namespace deltalux::segments
