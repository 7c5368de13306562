// SPDX-License-Identifier: Apache-2.0
// Walks a few of the paths that the bake will trace.
#include "update/pilot_paths.h"

#include <algorithm>

#include "base/direction.h"

namespace deltalux::update {

namespace {
constexpr uint64_t kPilotPaths = 8192;
}

PilotPaths walk_pilot_paths(const State& state, Progress& progress) {
  progress.begin("pilot", 1);
  PilotPaths paths;
  for (const trace::Light& light : state.lights) paths.all += light.path_count;
  const trace::Walk walk = state.walk();
  const uint64_t stride = std::max<uint64_t>(1, paths.all / kPilotPaths);
  for (uint32_t l = 0; l < state.lights.size(); ++l) {
    const trace::Light& light = state.lights[l];
    const auto quanta = trace::birth_quanta(light, state.scale, 1.0);
    for (uint64_t i = stride / 2; i < light.path_count; i += stride) {
      trace::Flight flight = walk.birth(light, i, quanta);
      for (uint32_t bounce = 0;; ++bounce) {
        const trace::Landing landing = walk.fly(flight, bounce);
        paths.flights.push_back({flight.origin, decode_direction(flight.direction), landing.length,
                                 std::max(landing.length, landing.extended), l, landing.primitive,
                                 bounce});
        paths.deepest = std::max(paths.deepest, bounce);
        if (!landing.survives) break;
        flight = landing.next;
      }
      if ((++paths.walked & 255) == 0) progress.check();
    }
  }
  return paths;
}

}  // namespace deltalux::update
