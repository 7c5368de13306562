// SPDX-License-Identifier: Apache-2.0
// Casts a few rays from places on lit cells; bright cells that they hit seldom are tested apart.
#include "gather/choose/brightness_survey.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/random.h"
#include "gather/aim/directions.h"
#include "gather/aim/guide.h"
#include "gather/choose/radiosity.h"

namespace deltalux::gather {
namespace {

constexpr uint32_t kPilotRays = 64;  // from each place
constexpr size_t kMostRare = 4096;   // bright cells, at most, that few of these rays hit
// cells with fewer hits than this, for which the count is mostly chance
constexpr uint32_t kFew = 8;
constexpr uint32_t kTests = 64;  // places from which each of those cells is tested
// quantile of the light around places, relative to which cells count as bright
constexpr double kDim = 0.1;

/// What one place's rays hit.
struct PlaceHits {
  std::vector<BrightHit> hits;
  float all = 0;  ///< sum of the radiosities, including light of beams
};

PlaceHits hits_of(const Context& context, const Evaluation& evaluation, const CellFinder& finder,
                  const Directions& directions, const direct::Receiver& receiver) {
  PlaceHits place_hits;
  auto& [out, all] = place_hits;
  const Vec3f origin = receiver.point + receiver.normal * receiver.slack();
  for (uint32_t ray = 0; ray < kPilotRays; ++ray) {
    const Vec3f w = directions(receiver.key, ray, receiver.normal);
    const auto [hit, cell] = meet(context, finder, origin, w);
    if (cell == kNoCell || hit.t < context.cells.near(cell)) continue;
    const Vec3f normal = trace::facing_normal(hit, w);
    const float radiosity = evaluation.brightness(cell);
    // Skip slivers, whose normals are unreliable: hits there might have no neighbours.
    if (!is_unit(normal) || !std::isfinite(radiosity)) continue;
    out.push_back({origin + w * hit.t, normal, cell, radiosity, 0, 0});
    all += radiosity;
  }
  // Add the light of beams, which cells do not hold.
  for (size_t b = 0; b < context.beams.size(); ++b)
    all += kPilotRays * context.beams[b].brought(origin, receiver.normal);
  if (!(all > 0)) return {};
  for (BrightHit& own : out) {
    own.weight = double(own.radiosity / all) * double(own.radiosity / all);
    own.around = all / kPilotRays;
  }
  return place_hits;
}

/// A rarely hit cell that some places are tested against.
struct RareCell {
  size_t lit;  ///< index among the lit cells
  /// The noise that it causes where it is visible, up to a constant factor.
  double noise;
};

/// Of the cells brighter than `least` that few rays hit, those that cause most noise. `hits`: by
/// cell.
std::vector<RareCell> rarely_hit(const Context& context, const Evaluation& evaluation,
                                 const LitCells& lit, std::span<const uint32_t> hits, float least) {
  std::vector<RareCell> out;
  for (size_t i = 0; i < lit.size(); ++i) {
    const uint32_t cell = lit.number(i);
    const float radiosity = evaluation.brightness(cell);
    if (hits[cell] >= kFew || !(radiosity > least) || !std::isfinite(radiosity)) continue;
    const double area = double(context.cells.area(cell));
    out.push_back({i, double(radiosity) * double(radiosity) * area});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const RareCell& a, const RareCell& b) { return a.noise > b.noise; });
  if (out.size() > kMostRare) out.resize(kMostRare);
  return out;
}

/// What a place's rays would hit of the cell on average; none if the cell is not
/// visible. `all`: sum of the radiosities that its rays hit.
std::optional<BrightHit> expected_hit(const Context& context, const Evaluation& evaluation,
                                      const direct::Receiver& pilot, float all, uint32_t cell,
                                      const direct::Receiver& place) {
  const Vec3f origin = pilot.point + pilot.normal * pilot.slack();
  const Vec3f to = place.point + place.normal * place.slack();
  const Vec3f d = to - origin;
  const float distance = length(d);
  if (!(distance > context.cells.near(cell))) return std::nullopt;
  const Vec3f w = d * (1 / distance);
  const float here = dot(w, pilot.normal), there = -dot(w, place.normal);
  if (!(here > 0) || !(there > 0) || context.caster.occluded(origin, w, distance))
    return std::nullopt;
  const float chance = std::min(1.0f, here * there * context.cells.area(cell) /
                                          (std::numbers::pi_v<float> * distance * distance));
  const float radiosity = evaluation.brightness(cell);
  all += kPilotRays * chance * radiosity;
  const double share = double(radiosity / all);
  return BrightHit{place.point, place.normal,     cell,
                   radiosity,   all / kPilotRays, kPilotRays * double(chance) * share * share};
}

/// Expected hits of one cell by rays of some of the places; their weights represent all places.
std::vector<BrightHit> expected_hits(const Context& context, const Evaluation& evaluation,
                                     std::span<const direct::Receiver> pilots,
                                     std::span<const PlaceHits> places, const LitCells& lit,
                                     size_t rare, uint64_t seed) {
  std::vector<BrightHit> out;
  const PathRandom random(seed ^ 0x61736b65642121ull, lit.place(rare, 0).key);
  for (uint32_t k = 0; k < kTests; ++k) {
    const auto number = size_t(random(k, 0) * float(pilots.size()));
    const size_t pilot = std::min(number, pilots.size() - 1);
    if (!(places[pilot].all > 0)) continue;
    const auto from = uint32_t(random(k, 1) * float(LitCells::kPlaces)) % LitCells::kPlaces;
    auto own = expected_hit(context, evaluation, pilots[pilot], places[pilot].all, lit.number(rare),
                            lit.place(rare, from));
    if (!own) continue;
    own->weight *= double(pilots.size()) / kTests;
    out.push_back(*own);
  }
  return out;
}

}  // namespace

BrightnessSurvey::BrightnessSurvey(const Context& context, const Evaluation& evaluation,
                                   const LitCells& lit, uint64_t seed, const Workers& workers,
                                   Progress& progress) {
  const std::vector<direct::Receiver> pilots = lit_places(lit);
  const Directions directions(kPilotRays, seed ^ 0x6775696465212121ull);
  const CellFinder finder(context.scene, context.cells);
  std::vector<PlaceHits> found(pilots.size());
  progress.begin("find bright places", found.size());
  workers.for_blocks(found.size(), 16, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      found[i] = hits_of(context, evaluation, finder, directions, pilots[i]);
    progress.advance(end - begin);
  });
  hits.resize(context.cells.size());
  std::vector<float> around;
  for (const PlaceHits& place_hits : found) {
    if (place_hits.all > 0) around.push_back(place_hits.all / kPilotRays);
    for (const BrightHit& hit : place_hits.hits) ++hits[hit.cell];
  }
  if (around.empty()) return;
  const float least = BrightHit::kBright * quantile(around, kDim);
  const std::vector<RareCell> rare = rarely_hit(context, evaluation, lit, hits, least);
  std::vector<std::vector<BrightHit>> expected(rare.size());
  workers.for_blocks(rare.size(), 64, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      expected[i] = expected_hits(context, evaluation, pilots, found, lit, rare[i].lit, seed);
  });
  std::vector<bool> is_rare(hits.size());
  for (const RareCell& own : rare) is_rare[lit.number(own.lit)] = true;
  for (const PlaceHits& place_hits : found)
    for (const BrightHit& hit : place_hits.hits)
      if (!is_rare[hit.cell]) all.push_back(hit);
  for (const auto& own : expected) all.insert(all.end(), own.begin(), own.end());
  for (const BrightHit& hit : all) variance += hit.weight;
  std::stable_sort(all.begin(), all.end(), [](const BrightHit& a, const BrightHit& b) {
    return a.bright() != b.bright() ? a.bright() : a.weight > b.weight;
  });
}

float quantile(std::vector<float>& values, double share) {
  const auto at = values.begin() + long(share * double(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace deltalux::gather
