// SPDX-License-Identifier: Apache-2.0
// Updates the beams after edits, and finds the cells that they may reach.
#include "gather/beams.h"

#include <algorithm>

namespace deltalux::gather {
void BeamChange::merge(const BeamChange& later) {
  touched |= later.touched, placed |= later.placed;
  points.resize(later.points.size());
  for (size_t i = 0; i < points.size(); ++i) points[i] |= later.points[i];
}

Beams::Beams(std::span<const BeamGuide> guides, const scene::Scene& scene,
             std::span<const trace::Light> lights, const trace::RayCaster& caster,
             const Cells& cells, uint64_t seed)
    : seed_(seed) {
  if (guides.empty()) return;
  for (const BeamGuide& guide : guides) {
    beams_.emplace_back(lights[guide.light], guide, scene.beyond(), seed).compute(caster);
    lights_.resize(std::max(lights_.size(), size_t(guide.light) + 1));
    lights_[guide.light] = 1;
  }
  find_reach(scene, cells, {});
}

float Beams::beside(Vec3f place) const {
  float most = 0;
  for (const Beam& beam : beams_) most = std::max(most, beam.beside(place));
  return most;
}

void Beams::find_reach(const scene::Scene& scene, const Cells& cells,
                       std::span<const uint32_t> objects) {
  reach_.resize(cells.size(), 0);
  cells.each_landing(scene, objects, [&](uint32_t cell, const BodyCells::Ball& ball) {
    uint64_t reach = 0;
    for (size_t b = 0; b < beams_.size(); ++b)
      reach |= uint64_t(beams_[b].may_meet(ball.centre, ball.radius)) << b;
    reach_[cell] = reach;
  });
}

BeamChange Beams::update(const scene::Scene& scene, std::span<const trace::Light> lights,
                         const trace::RayCaster& caster, const Cells& cells,
                         std::span<const uint32_t> objects, std::span<const Box> boxes) {
  BeamChange change;
  if (beams_.empty()) return change;
  change.points.assign(beams_.size() * Beam::kPoints, 0);
  for (size_t b = 0; b < beams_.size(); ++b) {
    const trace::Light& light = lights[beams_[b].guide().light];
    const auto points = std::span(change.points).subspan(b * Beam::kPoints, Beam::kPoints);
    if (!beams_[b].differs(light)) {
      change.touched |= beams_[b].update(caster, boxes, points);
      continue;
    }
    Beam placed(light, beams_[b].guide(), scene.beyond(), seed_);
    placed.compute(caster);
    beams_[b] = std::move(placed);
    std::fill(points.begin(), points.end(), uint8_t(1));
    change.placed |= uint64_t(1) << b;
  }
  change.touched |= change.placed != 0;
  find_reach(scene, cells, change.placed ? std::span<const uint32_t>{} : objects);
  return change;
}

}  // namespace deltalux::gather
