// SPDX-License-Identifier: Apache-2.0
// Traces all paths of a scene's lights into a table with one row per segment.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "trace/lights.h"
#include "trace/walk.h"

namespace deltalux::trace {

/// Rows are ordered by path, then by bounce.
struct FlightColumns {
  std::vector<float> origin, direction;  ///< 3 per row
  std::vector<float> length, extended;   ///< distance to the first and to the second hit
  std::vector<uint32_t> power;           ///< 3 per row, in quanta
  std::vector<uint32_t> path, primitive, group;
  std::vector<uint16_t> bounce;

  size_t size() const { return length.size(); }
};

/// Traces all paths. Throws Cancelled.
FlightColumns trace_flights(const Walk& walk, std::span<const Light> lights,
                            const EnergyScale& scale, const Workers& workers, Progress& progress);

}  // namespace deltalux::trace
