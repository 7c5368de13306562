// SPDX-License-Identifier: Apache-2.0
// Pilots in lit cells, and what a few rays of each meet.
#include "gather/votes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "gather/directions.h"
#include "gather/guide.h"

namespace deltalux::gather {
namespace {

constexpr size_t kPilots = 1024;     // at most
constexpr uint32_t kPilotRays = 64;  // of each

std::vector<Vote> vote(const Present& present, const Evaluation& evaluation,
                       const CellFinder& finder, const Directions& directions,
                       const direct::Receiver& receiver) {
  std::vector<Vote> out;
  const Vec3f origin = receiver.point + receiver.normal * receiver.slack();
  float all = 0;
  for (uint32_t ray = 0; ray < kPilotRays; ++ray) {
    const Vec3f w = directions(receiver.key, ray, receiver.normal);
    const trace::Hit hit = present.caster.closest(origin, w);
    if (!hit.valid()) continue;
    const uint32_t cell = finder.find(hit.primitive, origin, w, hit.t);
    if (cell == kNoCell || hit.t < present.cells.near(cell)) continue;
    const Vec3f normal = trace::facing_normal(hit, w);
    const float radiosity = evaluation.brightness(cell);
    // Slivers have no normal that one could trust, and such a vote could stand beside nothing.
    if (!is_unit(normal) || !std::isfinite(radiosity)) continue;
    out.push_back({origin + w * hit.t, normal, cell, radiosity, 0, 0});
    all += radiosity;
  }
  // Of beams whose light cells do not hold.
  for (size_t b = 0; b < present.beams.size(); ++b)
    all += kPilotRays * present.beams[b].brought(origin, receiver.normal).irradiance;
  if (!(all > 0)) return {};
  for (Vote& own : out) {
    own.weight = double(own.radiosity / all) * double(own.radiosity / all);
    own.around = all / kPilotRays;
  }
  return out;
}

}  // namespace

std::vector<direct::Receiver> lit_places(const Present& present, const Evaluation& evaluation,
                                         std::span<const uint16_t> covered) {
  std::vector<direct::Receiver> lit;
  present.cells.each_body([&](uint32_t first, uint32_t object, const BodyCells& body) {
    const bool moves = object != scene::kNone;
    if (moves && !present.scene.objects[object].present) return;
    const Pose pose = moves ? present.scene.objects[object].pose : Pose{};
    for (uint32_t own = 0; own < body.size(); ++own) {
      if (!body.has_probes(own) || !(evaluation.brightness(first + own) > 0)) continue;
      const int bare = std::countr_one(covered[first + own]);
      if (bare >= int(BodyCells::kProbes)) continue;
      const Vec3f p = body.probe(own, uint32_t(bare)), n = body.normal(own);
      lit.push_back(
          {pose.point(p), pose.direction(n), object, body.rise(), direct::place_key(p, n)});
    }
  });
  const size_t step = (lit.size() + kPilots - 1) / kPilots;
  for (size_t i = 0; i * step < lit.size(); ++i) lit[i] = lit[i * step];
  if (step > 1) lit.resize((lit.size() + step - 1) / step);
  return lit;
}

Votes::Votes(const Present& present, const Evaluation& evaluation,
             std::span<const uint16_t> covered, uint64_t seed, const Workers& workers,
             Progress& progress) {
  const std::vector<direct::Receiver> pilots = lit_places(present, evaluation, covered);
  const Directions directions(kPilotRays, seed ^ 0x6775696465212121ull);
  const CellFinder finder(present.scene, present.cells);
  std::vector<std::vector<Vote>> found(pilots.size());
  progress.begin("find bright places", found.size());
  workers.for_blocks(found.size(), 16, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      found[i] = vote(present, evaluation, finder, directions, pilots[i]);
    progress.advance(end - begin);
  });
  for (const std::vector<Vote>& own : found)
    for (const Vote& vote : own) all.push_back(vote), variance += vote.weight;
  // Bright ones come first: who is bright follows from the weight.
  std::stable_sort(all.begin(), all.end(),
                   [](const Vote& a, const Vote& b) { return a.weight > b.weight; });
}

float median(std::vector<float>& values) {
  const auto middle = values.begin() + long(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace deltalux::gather
