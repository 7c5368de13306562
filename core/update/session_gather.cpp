// SPDX-License-Identifier: Apache-2.0
// Where the session meets the final gather: cells, what samples see, and what an edit changes.
#include <numeric>

#include "samples/placement.h"
#include "update/landings.h"
#include "update/session.h"

namespace deltalux::update {

void Session::make_cells() {
  State& s = *state_;
  s.gather.reset();
  if (!s.options.gather_rays) return;
  s.gather = std::make_unique<Gather>(
      Gather{gather::Cells(s.scene, samples::scene_metre(s.scene, *s.caster)),
             {},
             {},
             gather::Looks(s.samples.size(), s.options.gather_rays, s.options.seed)});
  grow_cell_sums();
}

void Session::grow_cell_sums() {
  State& s = *state_;
  if (!s.gather) return;
  for (uint32_t i = uint32_t(s.gather->cells.objects()); i < s.scene.objects.size(); ++i)
    s.gather->cells.add_object(s.scene, i);
  gather::CellSums& sums = s.gather->sums;
  sums.groups = s.sum_groups();
  sums.batches = kBatches;
  sums.quanta.resize(sums.at(s.gather->cells.size(), 0, 0), 0);
}

void Session::shrink_cell_sums() noexcept {
  State& s = *state_;
  if (!s.gather) return;
  s.gather->cells.drop_objects(s.scene.objects.size());
  s.gather->sums.quanta.resize(s.gather->sums.at(s.gather->cells.size(), 0, 0));
}

void Session::look_around(Progress& progress) {
  State& s = *state_;
  if (!s.gather) return;
  s.gather->coverage.compute(s.scene, *s.caster, s.gather->cells, s.workers);
  s.gather->looks.cast({s.scene, *s.caster, s.lights, receivers_, s.gather->cells}, s.workers,
                       progress);
}

void Session::restore_looks(ArchiveSource& archive) {
  State& s = *state_;
  if (!s.gather) return;
  const Landings landings(s);
  std::vector<uint32_t> slots;
  for (uint32_t b = 0; b < s.store.levels().size(); ++b) {
    slots.resize(s.store.levels()[b].size());
    std::iota(slots.begin(), slots.end(), 0u);
    landings.add(b, slots, +1);
  }
  s.gather->coverage.compute(s.scene, *s.caster, s.gather->cells, s.workers);
  s.gather->looks.restore(archive, {s.scene, *s.caster, s.lights, receivers_, s.gather->cells});
}

void Session::update_looks(std::span<const ObjectChange> changes, bool lights, Progress& progress,
                           Report& report) {
  State& s = *state_;
  if (!s.gather || (changes.empty() && !lights)) return;
  gather::Change change;
  change.lights = lights;
  change.samples.assign(s.samples.size(), 0);
  for (const ObjectChange& c : changes) {
    change.objects.push_back(c.object);
    if (!c.before.empty()) change.before.push_back(c.before);
    if (!c.after.empty()) change.after.push_back(c.after);
    for (const trace::Light& light : s.lights) change.lights |= light.object == c.object;
    for (const MovingPart& part : s.moving)
      if (part.object == c.object)
        for (uint32_t id : part.index->discs().id) change.samples[id] = 1;
  }
  std::vector<Box> boxes = change.before;
  boxes.insert(boxes.end(), change.after.begin(), change.after.end());
  s.gather->coverage.update(s.scene, *s.caster, s.gather->cells, change.objects, boxes, s.workers);
  report.gathered_rays = s.gather->looks.update(
      {s.scene, *s.caster, s.lights, receivers_, s.gather->cells}, change, s.workers, progress);
}

}  // namespace deltalux::update
