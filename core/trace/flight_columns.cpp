// SPDX-License-Identifier: Apache-2.0
// Traces blocks of paths in parallel, and appends their segments in the order of the paths.
#include "trace/flight_columns.h"

#include <algorithm>
#include <array>
#include <numeric>

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

/// The segments of several paths, as they were traced, and their order path by path.
struct Block {
  std::vector<Row> rows;
  std::vector<uint32_t> order;
};

/// Traces paths that begin so, whose numbers follow each other, bounce by bounce.
Block traced(const Walk& walk, std::vector<Flight> flights) {
  Block out;
  const uint32_t first_path = flights.front().path;
  std::vector<uint32_t> begin(flights.size() + 1);  // of each path's rows in the order
  std::array<Hit, Walk::kTogether> hits;
  for (uint32_t bounce = 0; !flights.empty(); ++bounce) {
    std::vector<Flight> next;
    for (size_t first = 0; first < flights.size(); first += hits.size()) {
      const std::span<const Flight> together =
          std::span(flights).subspan(first, std::min(hits.size(), flights.size() - first));
      for (size_t k = 0; k < together.size(); ++k) hits[k] = walk.meet(together[k]);
      walk.fetch({hits.data(), together.size()});
      for (size_t k = 0; k < together.size(); ++k) {
        const Interaction own = walk.scatter(together[k], bounce, hits[k]);
        if (own.survives) next.push_back(own.next);
        out.rows.push_back({together[k], own, bounce});
        ++begin[together[k].path - first_path + 1];
      }
    }
    flights = std::move(next);
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  out.order.resize(out.rows.size());
  for (uint32_t i = 0; i < out.rows.size(); ++i)
    out.order[begin[out.rows[i].flight.path - first_path]++] = i;
  return out;
}

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
      std::vector<Block> blocks((count + kPaths - 1) / kPaths);
      workers.for_blocks(count, kPaths, [&](size_t begin, size_t end) {
        progress.check();
        std::vector<Flight> births;
        for (size_t i = begin; i < end; ++i) births.push_back(walk.birth(light, first + i, quanta));
        blocks[begin / kPaths] = traced(walk, std::move(births));
        progress.advance(end - begin);
      });
      for (const Block& block : blocks)
        for (const uint32_t row : block.order) append(out, block.rows[row], light.group);
    }
  }
  return out;
}

}  // namespace deltalux::trace
