// SPDX-License-Identifier: Apache-2.0
// The suns that shine at present, and their directions.
#include "gather/aim/suns.h"

namespace deltalux::gather {

Suns::Suns(std::span<const uint32_t> chosen, std::span<const trace::Light> lights) {
  for (const uint32_t light : chosen) {
    if (!lights[light].on) continue;
    shines_.resize(size_t(light) + 1);
    shines_[light] = 1;
    lights_.push_back(light);
    directions_.push_back(lights[light].punctual.direction);
  }
}

const char* Suns::flaw(std::span<const uint32_t> chosen, std::span<const trace::Light> lights) {
  for (size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i] >= lights.size() || !lights[chosen[i]].is_parallel())
      return "a sun that is not there";
    if (i && chosen[i] <= chosen[i - 1]) return "suns that are not in order";
  }
  return nullptr;
}

}  // namespace deltalux::gather
