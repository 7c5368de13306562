// SPDX-License-Identifier: Apache-2.0
// Brute force over all pairs, deliberately without any optimisation.
#include "estimate/brute_force.h"

#include "estimate/crossing.h"

namespace deltalux::estimate {

Stats BruteForce::accumulate(const segments::SegmentSpan& s, int sign, const EnergySums& sums,
                             HitSlots* slots) const {
  Stats stats;
  for (size_t i = 0; i < s.count; ++i) {
    const Vec3f o{s.ox[i], s.oy[i], s.oz[i]}, w{s.dx[i], s.dy[i], s.dz[i]};
    uint32_t hits = 0;
    HitSlots found;
    for (size_t k = 0; k < discs_.size(); ++k) {
      const Crossing crossing = crosses(discs_, k, o, w, s.length[i], s.extended[i], rule_);
      if (!crossing.hit) continue;
      const uint32_t slab = s.slab ? s.slab[i] : 0;
      sums.add(slab, discs_.id[k], s.power + 3 * i, sign);
      if (sums.moments) add_moments(sums, discs_, k, crossing.offset, slab, s.power + 3 * i, sign);
      if (hits < 2) found.disc[hits] = uint32_t(k);
      ++hits;
    }
    if (hits > 2) found.disc[0] = found.disc[1] = HitSlots::kMany;
    if (slots) slots[i] = found;
    stats.hits += hits;
    stats.disc_tests += discs_.size();
  }
  return stats;
}

}  // namespace deltalux::estimate
