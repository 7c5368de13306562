// SPDX-License-Identifier: Apache-2.0
// Walks a few of the paths that the bake will trace.
#include "session/paths/pilot_paths.h"

#include <algorithm>

#include "base/direction.h"

namespace deltalux::session {

PilotPaths walk_pilot_paths(const World& world, Progress& progress) {
  progress.begin("pilot", 1);
  PilotPaths paths;
  paths.all = world.all_paths();
  paths.held = world.held().size();
  const trace::Walk walk = world.walk();
  world.each_pilot_path([&](uint32_t l, uint64_t i) {
    const trace::Light& light = world.lights[l];
    const auto keep = [&](const trace::Flight& flight, const trace::Interaction& interaction,
                          uint32_t bounce) {
      paths.flights.push_back(
          {flight.origin, decode_direction(flight.direction), interaction.length,
           std::max(interaction.length, interaction.extended), l, interaction.primitive, bounce});
      paths.deepest = std::max(paths.deepest, bounce);
    };
    walk.follow(walk.birth(light, i, trace::birth_quanta(light, world.scale, 1.0)), keep);
    if ((++paths.walked & 255) == 0) progress.check();
  });
  return paths;
}

}  // namespace deltalux::session
