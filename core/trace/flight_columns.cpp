// SPDX-License-Identifier: Apache-2.0
// Traces blocks of paths in parallel, and appends their segments in the order of the paths.
#include "trace/flight_columns.h"

#include "base/direction.h"

namespace deltalux::trace {
namespace {

constexpr size_t kPaths = 512;          // paths per block
constexpr size_t kRound = 64 * kPaths;  // paths whose segments are in memory twice at a time

struct Row {
  Flight flight;
  Interaction interaction;
  uint32_t bounce;
};

void append(FlightColumns& out, const Row& row, uint32_t group) {
  const Vec3f w = decode_direction(row.flight.direction), o = row.flight.origin;
  out.origin.insert(out.origin.end(), {o.x, o.y, o.z});
  out.direction.insert(out.direction.end(), {w.x, w.y, w.z});
  out.length.push_back(row.interaction.length);
  out.extended.push_back(row.interaction.extended);
  out.power.insert(out.power.end(), row.flight.power, row.flight.power + 3);
  out.path.push_back(row.flight.path);
  out.primitive.push_back(row.interaction.primitive);
  out.bounce.push_back(uint16_t(row.bounce));
  out.group.push_back(group);
}

}  // namespace

FlightColumns trace_flights(const Walk& walk, std::span<const Light> lights,
                            const EnergyScale& scale, const Workers& workers, Progress& progress) {
  uint64_t total = 0;
  for (const Light& light : lights) total += light.path_count;
  progress.begin("trace paths", total);
  FlightColumns out;
  for (const Light& light : lights) {
    const auto quanta = birth_quanta(light, scale, 1.0);
    for (size_t first = 0; first < light.path_count; first += kRound) {
      const size_t count = std::min<size_t>(kRound, light.path_count - first);
      std::vector<std::vector<Row>> blocks((count + kPaths - 1) / kPaths);
      workers.for_blocks(count, kPaths, [&](size_t begin, size_t end) {
        progress.check();
        std::vector<Row>& own = blocks[begin / kPaths];
        for (size_t i = begin; i < end; ++i)
          walk.follow(walk.birth(light, first + i, quanta),
                      [&](const Flight& flight, const Interaction& interaction, uint32_t bounce) {
                        own.push_back({flight, interaction, bounce});
                      });
        progress.advance(end - begin);
      });
      for (const std::vector<Row>& block : blocks)
        for (const Row& row : block) append(out, row, light.group);
    }
  }
  return out;
}

}  // namespace deltalux::trace
