// SPDX-License-Identifier: Apache-2.0
// Updates the beams after edits, and finds the cells that they may reach.
#include "gather/aim/beams.h"

#include <algorithm>

namespace deltalux::gather {

Beams::Beams(std::span<const BeamGuide> guides, const scene::Scene& scene,
             std::span<const trace::Light> lights, const trace::RayCaster& caster,
             const Cells& cells, uint64_t seed)
    : seed_(seed) {
  if (guides.empty()) return;
  for (const BeamGuide& guide : guides) {
    const auto number = uint32_t(beams_.size());
    beams_.emplace_back(lights[guide.light], guide, number, scene.beyond(), seed).compute(caster);
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
      reach |= uint64_t(beams_[b].may_reach(ball.centre, ball.radius)) << b;
    reach_[cell] = reach;
  });
}

uint64_t Beams::placed(const trace::Change& change) const {
  uint64_t placed = 0;
  for (size_t b = 0; b < beams_.size(); ++b)
    placed |= uint64_t(change.changes(beams_[b].guide().light)) << b;
  return placed;
}

std::vector<uint8_t> Beams::update(const scene::Scene& scene, std::span<const trace::Light> lights,
                                   const trace::RayCaster& caster, const Cells& cells,
                                   const trace::Change& change) {
  std::vector<uint8_t> differs(beams_.size() * Beam::kPoints);
  bool any = false;
  for (size_t b = 0; b < beams_.size(); ++b) {
    const uint32_t lamp = beams_[b].guide().light;
    const auto points = std::span(differs).subspan(b * Beam::kPoints, Beam::kPoints);
    if (!change.changes(lamp)) {
      any |= beams_[b].update(caster, change, points);
      continue;
    }
    Beam placed(lights[lamp], beams_[b].guide(), uint32_t(b), scene.beyond(), seed_);
    placed.compute(caster);
    beams_[b] = std::move(placed);
    std::fill(points.begin(), points.end(), uint8_t(1));
    any = true;
  }
  std::vector<uint32_t> objects;
  for (const trace::MovedObject& moved : change.objects) objects.push_back(moved.object);
  if (!beams_.empty())
    find_reach(scene, cells, placed(change) ? std::span<const uint32_t>{} : objects);
  return any ? differs : std::vector<uint8_t>{};
}

}  // namespace deltalux::gather
