// SPDX-License-Identifier: Apache-2.0
// Adds up the power of all stored segments.
#include "session/read/audit.h"

#include <algorithm>

namespace deltalux::session {

EnergyAudit audit(const State& s) {
  int finest = s.sum_groups.front().finer;
  for (const SumGroup& group : s.sum_groups) finest = std::max(finest, group.finer);
  EnergyAudit audit;
  audit.quantum = s.scale.of(finest);
  const auto add = [finest](EnergyAudit::Quanta& sum, const uint32_t* power, int finer, int sign) {
    for (size_t c = 0; c < 3; ++c)
      sum[c] += sign * (EnergyAudit::Quanta::value_type(power[c]) << (finest - finer));
  };
  for (const trace::Light& light : s.lights) {
    if (!light.on) continue;
    const auto quanta = trace::birth_quanta(light, s.scale, s.birth_factor(light));
    const trace::Walk walk = s.walk();
    s.paths.held.each_of(light, [&](uint64_t i) {
      add(audit.emitted, walk.birth(light, i, quanta).power, light.finer, 1);
    });
  }
  const auto& bounces = s.paths.store.bounces();
  for (uint32_t b = 0; b < bounces.size(); ++b)
    for (uint32_t slot = 0; slot < bounces[b].size(); ++slot) {
      const segments::Segment& g = bounces[b].at(slot);
      if (g.length < 0) continue;
      const int finer = s.lights[s.light_of(g.path)].finer;
      if (g.primitive == scene::kNone) {
        add(audit.escaped, g.power, finer, 1);
        continue;
      }
      add(audit.absorbed, g.power, finer, 1);
      if (g.next != segments::kNoSlot)
        add(audit.absorbed, bounces[b + 1].at(g.next).power, finer, -1);
    }
  return audit;
}

}  // namespace deltalux::session
