// SPDX-License-Identifier: Apache-2.0
// All segments of all paths, by bounce. A segment is addressed by (bounce, slot) and holds the slot
// of its successor at the next bounce. Segments never move in memory; freed slots are reused.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "base/assertion.h"
#include "base/direction.h"
#include "base/vec.h"
#include "scene/scene.h"
#include "segments/hit_slots.h"
#include "segments/light_history.h"

namespace deltalux::segments {

inline constexpr uint32_t kNoSlot = 0xffffffffu;

/// One straight segment of a path. Stored as an array of structures: an update accesses few
/// segments at random, and a record takes about one cache line.
struct Segment {
  Vec3f origin;
  /// encoded; rays are traced along the decoded vector, see decode_direction()
  uint32_t direction;
  /// Distance to the first hit, or to the border of the world box; negative: the slot is not in
  /// use.
  float length;
  uint32_t power[3];  ///< quanta per channel
  uint32_t path;
  uint32_t primitive;  ///< first hit, or scene::kNone
  uint32_t next;       ///< slot of its successor at the next bounce, or kNoSlot
};
static_assert(sizeof(Segment) == 44);

/// The content of an unused slot. At bounce 0 each slot belongs to one path, whether it is in use
/// or not.
inline Segment unused_segment(uint32_t path = 0) {
  return {{}, 0, -1.0f, {0, 0, 0}, path, scene::kNone, kNoSlot};
}

/// What the scan tests of a segment: its bounding box on a grid over the world, with ends rounded
/// to cells, and which of the box's four diagonals it is. Each field (from bit 0: x, bit 11: z, bit
/// 22: y) is followed by a guard bit, so that one subtraction compares three fields: low <= high
/// holds in every field exactly if (high | kGuards) - low keeps the guards. The guards of `high`
/// are set; two of those of `low` encode the diagonal.
struct CellBox {
  uint32_t low, high;
};

/// The grid that cell boxes are rounded to.
struct ScanGrid {
  static constexpr uint32_t kGuards = 1u << 10 | 1u << 21 | 1u << 31;
  static constexpr uint32_t kFallsInZ = 1u << 10, kFallsInY = 1u << 21;  // in `low`, while x rises
  static constexpr float kCells[3] = {1023, 511, 1023};
  /// The cell box of an unused slot; it meets no box except one that covers the whole world.
  static constexpr CellBox kUnused{~kGuards, kGuards};

  Vec3f origin{}, cells_per_metre{1, 1, 1};

  ScanGrid() = default;
  explicit ScanGrid(const Box& world);
  /// Rounds to whole cells, and shifts each axis to its field.
  static uint32_t pack(Vec3f cells);
  /// World space to cells.
  Vec3f to_cells(Vec3f p) const;
  /// The cell box of the segment from `a` to `b`.
  CellBox cell_box(Vec3f a, Vec3f b) const;
};

/// Optional data that a session keeps for each segment.
struct Extras {
  bool extended = false;  ///< distance to the second hit
  bool landing = false;   ///< cell where it ends, see gather/cells/cells.h
  bool history = false;   ///< LightHistory: else it is direct at bounce 0, and indirect later
};

/// The segments of one bounce of all paths.
class BounceSegments {
 public:
  static constexpr uint32_t kChunk = 2048;
  struct Chunk {
    Segment segment[kChunk];
    uint32_t low[kChunk], high[kChunk];  ///< cell boxes
    HitSlots slots[kChunk];
    std::unique_ptr<float[]> extended;        ///< see Extras
    std::unique_ptr<uint32_t[]> landing;      ///< see Extras
    std::unique_ptr<LightHistory[]> history;  ///< see Extras
  };

  /// Number of slots, including free ones.
  uint32_t size() const { return size_; }
  /// Number of slots that are not free.
  size_t live() const { return size_ - free_.size(); }
  Segment& at(uint32_t slot) { return chunk(slot).segment[slot % kChunk]; }
  const Segment& at(uint32_t slot) const { return chunk(slot).segment[slot % kChunk]; }
  HitSlots& slots(uint32_t slot) { return chunk(slot).slots[slot % kChunk]; }
  float& extended(uint32_t slot) {
    DELTALUX_ASSERT(chunk(slot).extended);
    return chunk(slot).extended[slot % kChunk];
  }
  uint32_t& landing(uint32_t slot) {
    DELTALUX_ASSERT(chunk(slot).landing);
    return chunk(slot).landing[slot % kChunk];
  }
  uint32_t landing(uint32_t slot) const {
    DELTALUX_ASSERT(chunk(slot).landing);
    return chunk(slot).landing[slot % kChunk];
  }
  LightHistory& history(uint32_t slot) {
    DELTALUX_ASSERT(chunk(slot).history);
    return chunk(slot).history[slot % kChunk];
  }
  LightHistory history(uint32_t slot) const {
    DELTALUX_ASSERT(chunk(slot).history);
    return chunk(slot).history[slot % kChunk];
  }
  /// The distance to the second hit, or the length if that is not kept.
  float extended_or_length(uint32_t slot) const {
    const Chunk& c = chunk(slot);
    return c.extended ? c.extended[slot % kChunk] : c.segment[slot % kChunk].length;
  }
  void set_cell_box(uint32_t slot, CellBox box) {
    Chunk& c = chunk(slot);
    c.low[slot % kChunk] = box.low;
    c.high[slot % kChunk] = box.high;
  }
  Chunk& chunk(uint32_t slot) {
    DELTALUX_ASSERT(slot < size_);
    return *chunks_[slot / kChunk];
  }
  const Chunk& chunk(uint32_t slot) const {
    DELTALUX_ASSERT(slot < size_);
    return *chunks_[slot / kChunk];
  }

  /// Provides slots for `count` new segments, freed ones first. Not thread-safe.
  void allocate(size_t count, const Extras& extras, std::vector<uint32_t>& out);
  /// Frees a slot, whose segment must be marked as unused before. Not thread-safe.
  void release(uint32_t slot) {
    DELTALUX_ASSERT(at(slot).length < 0);
    free_.push_back(slot);
  }
  size_t bytes() const;

 private:
  std::vector<std::unique_ptr<Chunk>> chunks_;
  std::vector<uint32_t> free_;
  uint32_t size_ = 0;
};

/// The segments of all bounces.
class SegmentStore {
 public:
  SegmentStore() = default;
  SegmentStore(const Box& world, const Extras& extras) : grid_(world), extras_(extras) {}

  const ScanGrid& grid() const { return grid_; }
  const Extras& extras() const { return extras_; }
  bool with_extended() const { return extras_.extended; }
  LightHistory history(uint32_t bounce, uint32_t slot) const {
    if (extras_.history) return bounces_[bounce].history(slot);
    return bounce ? LightHistory::indirect : LightHistory::direct;
  }
  std::vector<BounceSegments>& bounces() { return bounces_; }
  const std::vector<BounceSegments>& bounces() const { return bounces_; }
  BounceSegments& bounce(size_t bounce) {
    if (bounces_.size() <= bounce) bounces_.resize(bounce + 1);
    return bounces_[bounce];
  }
  /// Calls visit(bounce, slot) for the segments of direct light of a path, in use or not, which
  /// begins at this slot: the first one, and those behind surfaces that it passed straight.
  template <class Visit>
  void each_direct(uint32_t slot, const Visit& visit) const {
    for (uint32_t bounce = 0;; ++bounce) {
      visit(bounce, slot);
      slot = bounces_[bounce].at(slot).next;
      if (!extras_.history || slot == kNoSlot || history(bounce + 1, slot) != LightHistory::direct)
        return;
    }
  }
  size_t live() const;
  size_t bytes() const;
  /// Recomputes the cell box of a segment from its origin, direction and extended length.
  void index(uint32_t bounce, uint32_t slot);

 private:
  ScanGrid grid_;
  Extras extras_;
  std::vector<BounceSegments> bounces_;
};

}  // namespace deltalux::segments
