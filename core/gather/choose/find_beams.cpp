// SPDX-License-Identifier: Apache-2.0
// Decides for each narrow spot, by the survey, whether it becomes a beam.
#include "gather/choose/find_beams.h"

#include <optional>
#include <unordered_map>

namespace deltalux::gather {
namespace {

constexpr float kFalloff = 0.3f;  // cells within this factor of each other count as equally bright
// a cell is lit by the spot if it gets at least half of its light from it
constexpr float kLitByIt = 2;

std::optional<BeamGuide> find_beam(const Context& context, const Evaluation& evaluation,
                                   const CellFinder& finder, const BrightnessSurvey& survey,
                                   uint32_t light, uint64_t seed) {
  const lights::Punctual& lamp = context.lights[light].punctual;
  Beam beam(context.lights[light], {light, 1, 1}, 0, context.scene.beyond(), seed);
  beam.compute(context.caster);
  // By cell: a pool of light may be smaller than the cell that counts it.
  std::unordered_map<uint32_t, float> power;
  double sent = 0;
  size_t landed = 0;
  const double each = lamp.kind->extent(lamp) / Beam::kPoints;
  for (uint32_t k = 0; k < Beam::kPoints; ++k) {
    const Beam::Point& point = beam.point(k);
    const Vec3f d = point.at - lamp.position;
    const float distance = length(d);
    if (!point.valid() || !(distance > 0)) continue;
    const uint32_t cell = finder.find(point.primitive, lamp.position, d * (1 / distance), distance);
    if (cell == kNoCell) continue;
    const Vec3f reflectance =
        context.cells.reflectance(cell, context.scene.materials[context.cells.material(cell)]);
    const float own = evaluation.dim(light) * dot(lamp.intensity, reflectance) * float(each);
    power[cell] += own, sent += double(own), ++landed;
  }
  std::vector<const BrightHit*> lit;
  float brightest = 0;
  for (const BrightHit& hit : survey.all) {
    const auto own = power.find(hit.cell);
    if (own == power.end() ||
        !(kLitByIt * own->second > hit.radiosity * context.cells.area(hit.cell)))
      continue;
    lit.push_back(&hit);
    brightest = std::max(brightest, hit.radiosity);
  }
  std::vector<float> around;
  size_t bright = 0, as_bright = 0;
  double weight = 0;
  for (const BrightHit* hit : lit) {
    around.push_back(hit->around);
    // Leave out cells at the pool's rim, which hold little of its light.
    as_bright += hit->radiosity > kFalloff * brightest;
    if (hit->bright()) ++bright, weight += hit->weight;
  }
  if (!BrightnessSurvey::suffice(bright, as_bright, weight, survey.variance)) return std::nullopt;
  const BeamGuide guide{light, float(sent * Beam::kPoints / double(landed)), quantile(around, 0.5)};
  return guide.flaw(context.lights) ? std::nullopt : std::optional(guide);
}

}  // namespace

std::vector<BeamGuide> find_beams(const Context& context, const Evaluation& evaluation,
                                  const BrightnessSurvey& survey, uint64_t seed) {
  const CellFinder finder(context.scene, context.cells);
  std::vector<BeamGuide> beams;
  for (uint32_t light = 0; light < context.lights.size(); ++light) {
    const trace::Light& lamp = context.lights[light];
    if (beams.size() == kMaxBeams || !lamp.on || !Beam::is_narrow(lamp)) continue;
    if (const auto beam = find_beam(context, evaluation, finder, survey, light, seed))
      beams.push_back(*beam);
  }
  return beams;
}

}  // namespace deltalux::gather
