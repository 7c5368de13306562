// SPDX-License-Identifier: Apache-2.0
// Brings stored segments to the estimators of the static and the moving samples, and takes them
// away again. Keeps the invariant: sums = estimator of the segments in the store.
#pragma once
#include <span>

#include "update/state.h"

namespace deltalux::update {

class Deposit {
 public:
  explicit Deposit(State& state);

  /// New segments of one bounce: searches the discs and remembers hits.
  void add(uint32_t bounce, std::span<const uint32_t> slots);
  /// Segments about to go: replays remembered hits, searches only where there were many.
  void remove(uint32_t bounce, std::span<const uint32_t> slots);
  /// Adds stored segments to one moving part only (whose sums were cleared).
  void add_to_part(MovingPart& part, uint32_t bounce, std::span<const uint32_t> slots);

 private:
  struct Block;
  bool counts(uint32_t bounce, const segments::Segment& segment, uint16_t& slab) const;
  void gather(Block& block, uint32_t bounce, uint32_t slot, const segments::Segment& segment,
              uint16_t slab) const;
  void to_moving(const Block& block, int sign) const;
  void to_part(const MovingPart& part, const Block& block, int sign) const;
  void flush_add(Block& block, uint32_t bounce) const;

  State& state_;
  estimate::EnergySums sums_;
};

/// Clears the sums of the samples of `part`.
void clear_part(State& state, const MovingPart& part);
/// Renews `part.world` from the object's pose.
void place_part(const State& state, MovingPart& part);

}  // namespace deltalux::update
