// SPDX-License-Identifier: Apache-2.0
// What of each cell lies bare: neither under something that stands or lies on it, nor inside of a
// body. No light lands on the rest, and no ray meets it.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "gather/cells.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

class Coverage {
 public:
  /// All from scratch.
  void compute(const scene::Scene& scene, const trace::RayCaster& caster, const Cells& cells,
               const Workers& workers);
  /// After objects changed: `boxes` are theirs before and after. New cells come last.
  void update(const scene::Scene& scene, const trace::RayCaster& caster, const Cells& cells,
              std::span<const uint32_t> objects, std::span<const Box> boxes,
              const Workers& workers);

  /// Share of a cell's area, at least a part of one probe.
  float bare(uint32_t cell) const;
  std::span<const uint16_t> covered() const { return covered_; }
  size_t bytes() const {
    return (fixed_.capacity() + covered_.capacity()) * sizeof(uint16_t) +
           reach_.capacity() * sizeof(Box);
  }

 private:
  // One bit per probe. Static cells: by the static scene, which never changes.
  std::vector<uint16_t> fixed_;
  std::vector<uint16_t> covered_;  // by whatever is there now
  std::vector<Box> reach_;         // of static cells' probes: what comes into it may cover them
};

}  // namespace deltalux::gather
