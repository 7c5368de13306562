// SPDX-License-Identifier: Apache-2.0
// Walks a few of the paths that the bake will trace.
#include "session/paths/pilot_paths.h"

#include <algorithm>

#include "base/direction.h"

namespace deltalux::session {

namespace {
constexpr uint64_t kPilotPaths = 8192;
}

PilotPaths walk_pilot_paths(const World& world, Progress& progress) {
  progress.begin("pilot", 1);
  PilotPaths paths;
  paths.all = world.all_paths();
  paths.held = world.held().size();
  const trace::Walk walk = world.walk();
  const uint64_t stride = std::max<uint64_t>(1, paths.all / kPilotPaths);
  for (uint32_t l = 0; l < world.lights.size(); ++l) {
    const trace::Light& light = world.lights[l];
    const auto quanta = trace::birth_quanta(light, world.scale, 1.0);
    for (uint64_t i = stride / 2; i < light.path_count; i += stride) {
      const auto keep = [&](const trace::Flight& flight, const trace::Interaction& interaction,
                            uint32_t bounce) {
        paths.flights.push_back(
            {flight.origin, decode_direction(flight.direction), interaction.length,
             std::max(interaction.length, interaction.extended), l, interaction.primitive, bounce});
        paths.deepest = std::max(paths.deepest, bounce);
      };
      walk.follow(walk.birth(light, i, quanta), keep);
      if ((++paths.walked & 255) == 0) progress.check();
    }
  }
  return paths;
}

}  // namespace deltalux::session
