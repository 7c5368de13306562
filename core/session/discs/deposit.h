// SPDX-License-Identifier: Apache-2.0
// Adds stored segments to the estimators of the static and of the moving samples, and removes them
// again. Invariant: the sums equal what the estimators make of the segments in the store. With
// several threads, only one thread at a time writes to a slab of sums, so that adding needs no
// atomics.
#pragma once
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "session/discs/disc_layer.h"
#include "session/discs/feed.h"
#include "session/paths/path_layer.h"

namespace deltalux::session {

class Deposit {
 public:
  Deposit(PathLayer& paths, DiscLayer& discs);
  /// Deposits into `sums` instead of the discs' own; both have the same layout.
  Deposit(PathLayer& paths, DiscLayer& discs, const estimate::EnergySums& sums);
  /// Completes the sums, which are not up to date before this call. Call it once after all
  /// additions and once after all removals.
  void finish();

  /// Adds all stored segments, for sums other than the discs' own, without remembering which discs
  /// they cross, and calls finish().
  void add_all(Progress& progress);
  /// Adds new segments of one bounce: finds the discs that they cross, and remembers these in
  /// HitSlots.
  void add(uint32_t bounce, std::span<const uint32_t> slots);
  /// Removes segments that are about to be deleted. Replays the remembered discs; searches again
  /// only for segments that crossed too many discs to remember.
  void remove(uint32_t bounce, std::span<const uint32_t> slots);
  /// Adds stored segments to one moving part only; its sums must have been cleared before.
  void add_to_part(const MovingPart& part, uint32_t bounce, std::span<const uint32_t> slots);

 private:
  /// Segments unpacked into a structure of arrays.
  struct SegmentBlock;
  /// Whether the segment is deposited on discs at all; if so, sets the slab that it adds to.
  bool counts(uint32_t bounce, uint32_t slot, uint16_t& slab) const;
  /// Appends one segment to the block.
  void gather(SegmentBlock& block, uint32_t bounce, uint32_t slot, const segments::Segment& segment,
              uint16_t slab) const;
  /// Fills the block with those of the given segments that count.
  void gather_counting(SegmentBlock& block, uint32_t bounce, std::span<const uint32_t> slots) const;
  /// Adds (sign +1) or removes (-1) the block for all moving parts whose sums are current.
  void to_moving(const SegmentBlock& block, int sign);
  void to_part(const MovingPart& part, const SegmentBlock& block, int sign);
  /// Passes on full portions of collected segments, see Feed::settle().
  void settle();
  /// Calls body(slots of one slab) for all slabs, in parallel. Leaves out segments that do not
  /// count. (With one thread, body gets the slots as they are, unsorted.)
  void for_slabs(uint32_t bounce, std::span<const uint32_t> slots,
                 const std::function<void(std::span<const uint32_t>)>& body);

  const World& world_;
  PathLayer& paths_;
  DiscLayer& discs_;
  estimate::EnergySums sums_;
  std::deque<Feed> feeds_;        // one for the static samples, then one for each moving part
  std::vector<uint32_t> sorted_;  // scratch memory of for_slabs
};

}  // namespace deltalux::session
