// SPDX-License-Identifier: Apache-2.0
// Compares what each light group brings to the cells.
#include "session/bake/choice_light.h"

#include <algorithm>

namespace deltalux::session {

std::vector<double> choice_factors(const State& s) {
  constexpr double kTint = 0.25;  // of the present light, that a dimmed group counts with
  const gather::CellSums& sums = s.cells.sums;
  std::vector<double> full(s.scene.group_count);  // landed power, undimmed
  double present = 0;
  for (uint32_t g = 0; g < s.sum_groups.size(); ++g) {
    const SumGroup& own = s.sum_groups[g];
    if (s.merged(own.group)) continue;  // their power holds their factors
    double landed = 0;
    for (uint32_t cell = 0; cell < s.cells.division.size(); ++cell)
      for (size_t k = 0; k < 3 * size_t(kBatches); ++k)
        landed += double(sums.quanta[sums.at(cell, s.cell_group(g, false), 0) + k]);
    full[own.group] += landed * s.scale.of(own.finer);
    present += landed * s.sum_unit(g);
  }
  std::vector<double> factors = s.group_factor;
  for (uint32_t group = 0; group < factors.size(); ++group) {
    if (factors[group] >= 1 || !(full[group] > 0)) continue;
    const double raised = present > 0 ? std::min(1.0, kTint * present / full[group]) : 1.0;
    factors[group] = std::max(factors[group], raised);
  }
  return factors;
}

}  // namespace deltalux::session
