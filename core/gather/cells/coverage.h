// SPDX-License-Identifier: Apache-2.0
// Finds the uncovered area of each cell: a cell is covered where something stands or lies on it, or
// where it is inside of a body. No light lands on covered area, and no ray meets it.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "gather/cells/cells.h"
#include "trace/change.h"

namespace deltalux::gather {

class Coverage {
 public:
  /// Recomputes all cells.
  void compute(const scene::Scene& scene, const trace::RayCaster& caster, const Cells& cells,
               const Workers& workers);
  /// Updates the cells after objects changed. New cells come last.
  void update(const scene::Scene& scene, const trace::RayCaster& caster, const Cells& cells,
              const trace::Change& change, const Workers& workers);

  /// The uncovered share of a cell's area; at least a quarter.
  /// By cell: one bit for each covered probe.
  float bare(uint32_t cell) const;
  std::span<const uint16_t> covered() const { return covered_; }
  size_t bytes() const {
    return (fixed_.capacity() + covered_.capacity()) * sizeof(uint16_t) +
           reach_.capacity() * sizeof(Box);
  }

 private:
  // One bit per probe: what the static scene covers. Probes of static cells are tested once.
  std::vector<uint16_t> fixed_;
  std::vector<uint16_t> covered_;  // covered by anything at present
  std::vector<Box> reach_;         // by static cell: the space where an object may cover its probes
};

}  // namespace deltalux::gather
