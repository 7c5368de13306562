// SPDX-License-Identifier: Apache-2.0
// Adds the power of stored segments to the sums of the cells where they land, and removes it again.
// Skips first flights from lights whose direct light gather rays compute by shadow rays (beams,
// suns).
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "gather/cells/cells.h"
#include "session/state/state.h"

namespace deltalux::session {

/// Valid for one state of the scene; does nothing in sessions without a final gather.
class Landings {
 public:
  explicit Landings(State& state);
  /// Finds the cell where the segment ends and stores it with the segment. Thread-safe for
  /// different slots.
  void note(segments::BounceSegments& stored, uint32_t slot) const;
  /// Adds (sign 1) or removes (-1) the given segments, if in use. Their cells must have been noted.
  void add(uint32_t bounce, std::span<const uint32_t> slots, int sign) const;
  /// The share of all gather rays that met a cell on which paths of this light land directly.
  /// `hits`: number of rays that met each cell.
  double share_lit_by(uint32_t light, std::span<const uint32_t> hits) const;

 private:
  State& state_;
  std::optional<gather::CellFinder> finder_;
  // Per light: 1 if its direct light at gather hits comes from shadow rays, not from cells.
  std::vector<uint8_t> by_shadow_ray_;
};

}  // namespace deltalux::session
