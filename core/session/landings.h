// SPDX-License-Identifier: Apache-2.0
// Counts light where it lands: adds stored segments to the sums of cells, and takes them away. But
// for what comes straight from lamps that are asked for where a ray lands.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "gather/cells.h"
#include "session/state.h"

namespace deltalux::session {

/// Of one state of the scene; does nothing in sessions that do not gather.
class Landings {
 public:
  explicit Landings(State& state);
  /// Notes where the segment ends. Thread-safe for different slots.
  void note(segments::BounceSegments& stored, uint32_t slot) const;
  /// Adds (sign 1) or takes away (-1) what is in use; its cells were noted.
  void add(uint32_t bounce, std::span<const uint32_t> slots, int sign) const;
  /// Share of these rays that met cells where paths come straight from the light. `hits`: per cell.
  double share_lit_by(uint32_t light, std::span<const uint32_t> hits) const;

 private:
  State& state_;
  std::optional<gather::CellFinder> finder_;
  std::vector<uint8_t> asked_for_;  // per light
};

}  // namespace deltalux::session
