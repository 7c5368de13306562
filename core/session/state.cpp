// SPDX-License-Identifier: Apache-2.0
// Chooses which sums the paths of each light add to.
#include "session/state.h"

namespace deltalux::session {

void assign_sums(std::span<trace::Light> lights, std::vector<SumGroup>& groups) {
  for (trace::Light& light : lights) {
    const SumGroup own{std::min(light.group, kMaxOwnGroups - 1), light.finer};
    const auto found = std::find(groups.begin(), groups.end(), own);
    light.sums = uint32_t(found - groups.begin());
    if (found == groups.end()) groups.push_back(own);
  }
}

}  // namespace deltalux::session
