// SPDX-License-Identifier: Apache-2.0
// Brings stored segments to the estimators of the static and the moving samples, and takes them
// away again. Keeps the invariant: sums = estimator of the segments in the store. With several
// threads each slab of sums is written by one thread at a time, so that adding needs no atomics.
#pragma once
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "session/feed.h"
#include "session/state.h"

namespace deltalux::session {

class Deposit {
 public:
  explicit Deposit(State& state);
  /// Deposits into other sums than the state's, laid out alike.
  Deposit(State& state, const estimate::EnergySums& sums);
  /// Sums are up to date only after this; once for all adding, once for all removing.
  void finish();

  /// All stored segments, for sums other than the state's; hits are not remembered. Finishes.
  void add_all(Progress& progress);
  /// New segments of one bounce: searches the discs and remembers hits.
  void add(uint32_t bounce, std::span<const uint32_t> slots);
  /// Segments about to go: replays remembered hits, searches only where there were many.
  void remove(uint32_t bounce, std::span<const uint32_t> slots);
  /// Adds stored segments to one moving part only (whose sums were cleared).
  void add_to_part(const MovingPart& part, uint32_t bounce, std::span<const uint32_t> slots);

 private:
  struct SegmentBlock;
  bool counts(uint32_t bounce, const segments::Segment& segment, uint16_t& slab) const;
  void gather(SegmentBlock& block, uint32_t bounce, uint32_t slot, const segments::Segment& segment,
              uint16_t slab) const;
  void gather_counting(SegmentBlock& block, uint32_t bounce, std::span<const uint32_t> slots) const;
  void to_moving(const SegmentBlock& block, int sign);
  void to_part(const MovingPart& part, const SegmentBlock& block, int sign);
  void settle();
  /// Calls body(slots of one slab) for all slabs, in parallel; slots that do not count are left
  /// out.
  void for_slabs(uint32_t bounce, std::span<const uint32_t> slots,
                 const std::function<void(std::span<const uint32_t>)>& body);

  State& state_;
  estimate::EnergySums sums_;
  std::deque<Feed> feeds_;        // of the static samples, then of each moving part
  std::vector<uint32_t> sorted_;  // scratch of for_slabs
};

/// Clears the sums of the samples of `part`.
void clear_part(State& state, const MovingPart& part);
/// Renews `part.world` from the object's pose.
void place_part(const State& state, MovingPart& part);

}  // namespace deltalux::session
