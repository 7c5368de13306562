// SPDX-License-Identifier: Apache-2.0
// Casts a few rays from places on lit cells, which vote for bright cells.
#include "gather/votes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/random.h"
#include "gather/directions.h"
#include "gather/guide.h"
#include "gather/radiosity.h"

namespace deltalux::gather {
namespace {

constexpr uint32_t kPilotRays = 64;  // from each place
constexpr size_t kAsked = 4096;      // bright cells, at most, that few of these rays hit
// cells with fewer hits than this, for which the count is mostly chance
constexpr uint32_t kFew = 8;
constexpr uint32_t kAskers = 64;  // places from which each of those cells is tested
// quantile of the light around places, relative to which cells count as bright
constexpr double kDim = 0.1;

/// The votes of one place's rays.
struct Poll {
  std::vector<Vote> votes;
  float all = 0;  ///< sum of the radiosities, including light of beams
};

Poll vote(const Present& present, const Evaluation& evaluation, const CellFinder& finder,
          const Directions& directions, const direct::Receiver& receiver) {
  Poll poll;
  auto& [out, all] = poll;
  const Vec3f origin = receiver.point + receiver.normal * receiver.slack();
  for (uint32_t ray = 0; ray < kPilotRays; ++ray) {
    const Vec3f w = directions(receiver.key, ray, receiver.normal);
    const auto [hit, cell] = meet(present, finder, origin, w);
    if (cell == kNoCell || hit.t < present.cells.near(cell)) continue;
    const Vec3f normal = trace::facing_normal(hit, w);
    const float radiosity = evaluation.brightness(cell);
    // Skip slivers, whose normals are unreliable: their votes might have no neighbours.
    if (!is_unit(normal) || !std::isfinite(radiosity)) continue;
    out.push_back({origin + w * hit.t, normal, cell, radiosity, 0, 0});
    all += radiosity;
  }
  // Add the light of beams, which cells do not hold.
  for (size_t b = 0; b < present.beams.size(); ++b)
    all += kPilotRays * present.beams[b].brought(origin, receiver.normal).irradiance;
  if (!(all > 0)) return {};
  for (Vote& own : out) {
    own.weight = double(own.radiosity / all) * double(own.radiosity / all);
    own.around = all / kPilotRays;
  }
  return poll;
}

/// A rarely hit cell that some places are tested against.
struct Asked {
  size_t lit;  ///< index among the lit cells
  /// The noise that it causes where it is visible, up to a constant factor.
  double noise;
};

/// Of the cells brighter than `least` that few rays hit, those that cause most noise. `hits`: by
/// cell.
std::vector<Asked> rarely_met(const Present& present, const Evaluation& evaluation,
                              const LitCells& lit, std::span<const uint32_t> hits, float least) {
  std::vector<Asked> out;
  for (size_t i = 0; i < lit.size(); ++i) {
    const uint32_t cell = lit.number(i);
    const float radiosity = evaluation.brightness(cell);
    if (hits[cell] >= kFew || !(radiosity > least) || !std::isfinite(radiosity)) continue;
    const double area = double(present.cells.area(cell));
    out.push_back({i, double(radiosity) * double(radiosity) * area});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Asked& a, const Asked& b) { return a.noise > b.noise; });
  if (out.size() > kAsked) out.resize(kAsked);
  return out;
}

/// The vote that a place's rays would cast for the cell on average; none if the cell is not
/// visible. `all`: sum of the radiosities that its rays hit.
std::optional<Vote> expected_vote(const Present& present, const Evaluation& evaluation,
                                  const direct::Receiver& pilot, float all, uint32_t cell,
                                  const direct::Receiver& place) {
  const Vec3f origin = pilot.point + pilot.normal * pilot.slack();
  const Vec3f to = place.point + place.normal * place.slack();
  const Vec3f d = to - origin;
  const float distance = length(d);
  if (!(distance > present.cells.near(cell))) return std::nullopt;
  const Vec3f w = d * (1 / distance);
  const float here = dot(w, pilot.normal), there = -dot(w, place.normal);
  if (!(here > 0) || !(there > 0) || present.caster.occluded(origin, w, distance))
    return std::nullopt;
  const float chance = std::min(1.0f, here * there * present.cells.area(cell) /
                                          (std::numbers::pi_v<float> * distance * distance));
  const float radiosity = evaluation.brightness(cell);
  all += kPilotRays * chance * radiosity;
  const double share = double(radiosity / all);
  return Vote{place.point, place.normal,     cell,
              radiosity,   all / kPilotRays, kPilotRays * double(chance) * share * share};
}

/// Expected votes of some of the places for one cell; their weights represent all places.
std::vector<Vote> expected_votes(const Present& present, const Evaluation& evaluation,
                                 std::span<const direct::Receiver> pilots,
                                 std::span<const Poll> polls, const LitCells& lit, size_t asked,
                                 uint64_t seed) {
  std::vector<Vote> out;
  const PathRandom random(seed ^ 0x61736b65642121ull, lit.place(asked, 0).key);
  for (uint32_t k = 0; k < kAskers; ++k) {
    const auto number = size_t(random(k, 0) * float(pilots.size()));
    const size_t pilot = std::min(number, pilots.size() - 1);
    if (!(polls[pilot].all > 0)) continue;
    const auto from = uint32_t(random(k, 1) * float(LitCells::kPlaces)) % LitCells::kPlaces;
    auto own = expected_vote(present, evaluation, pilots[pilot], polls[pilot].all,
                             lit.number(asked), lit.place(asked, from));
    if (!own) continue;
    own->weight *= double(pilots.size()) / kAskers;
    out.push_back(*own);
  }
  return out;
}

}  // namespace

Votes::Votes(const Present& present, const Evaluation& evaluation, const LitCells& lit,
             uint64_t seed, const Workers& workers, Progress& progress) {
  const std::vector<direct::Receiver> pilots = lit_places(lit);
  const Directions directions(kPilotRays, seed ^ 0x6775696465212121ull);
  const CellFinder finder(present.scene, present.cells);
  std::vector<Poll> found(pilots.size());
  progress.begin("find bright places", found.size());
  workers.for_blocks(found.size(), 16, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      found[i] = vote(present, evaluation, finder, directions, pilots[i]);
    progress.advance(end - begin);
  });
  hits.resize(present.cells.size());
  std::vector<float> around;
  for (const Poll& poll : found) {
    if (poll.all > 0) around.push_back(poll.all / kPilotRays);
    for (const Vote& vote : poll.votes) ++hits[vote.cell];
  }
  if (around.empty()) return;
  const float least = Vote::kBright * quantile(around, kDim);
  const std::vector<Asked> asked = rarely_met(present, evaluation, lit, hits, least);
  std::vector<std::vector<Vote>> expected(asked.size());
  workers.for_blocks(asked.size(), 64, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      expected[i] = expected_votes(present, evaluation, pilots, found, lit, asked[i].lit, seed);
  });
  std::vector<bool> is_asked(hits.size());
  for (const Asked& own : asked) is_asked[lit.number(own.lit)] = true;
  for (const Poll& poll : found)
    for (const Vote& vote : poll.votes)
      if (!is_asked[vote.cell]) all.push_back(vote);
  for (const auto& own : expected) all.insert(all.end(), own.begin(), own.end());
  for (const Vote& vote : all) variance += vote.weight;
  std::stable_sort(all.begin(), all.end(), [](const Vote& a, const Vote& b) {
    return a.bright() != b.bright() ? a.bright() : a.weight > b.weight;
  });
}

float quantile(std::vector<float>& values, double share) {
  const auto at = values.begin() + long(share * double(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace deltalux::gather
