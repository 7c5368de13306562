// SPDX-License-Identifier: Apache-2.0
// Follows the scene: objects, light groups and covers that come and go.
#include "session/cells/cell_layer.h"

#include <algorithm>

#include "samples/placement.h"

namespace deltalux::session {
namespace {

// Surface of a cube, 2 / 0.12^2 square scene metres, if a metre is 0.12 of its diagonal, see
// samples/placement.h.
constexpr double kRoom = 140;

}  // namespace

void CellLayer::divide(Progress& progress) {
  sums = {}, light = {}, coverage = {};
  if (!world.gathers()) return;
  progress.begin("divide surfaces", 1);
  division = gather::Cells(world.scene, *world.caster,
                           samples::scene_metre(world.scene, *world.caster), progress);
  grow(progress);
}

void CellLayer::grow(const Progress& progress) {
  if (!world.gathers()) return;
  for (uint32_t i = uint32_t(division.objects()); i < world.scene.objects.size(); ++i)
    division.add_object(world.scene, i, progress);
  division.expose(world.scene, *world.caster, world.workers, progress);
  lay_out_sums();
}

void CellLayer::shrink() noexcept {
  if (!world.gathers()) return;
  division.drop_objects(world.scene.objects.size());
  lay_out_sums();
}

void CellLayer::lay_out_sums() {
  if (!world.gathers()) return;
  sums.batches = kBatches;
  sums.set_groups(world.cell_groups());
  sums.quanta.resize(sums.at(division.size(), 0, 0), 0);
  sums.touched.resize(division.size(), 1);
}

void CellLayer::cover(Progress& progress) {
  progress.begin("cover cells", 1);
  coverage.compute(world.scene, *world.caster, division, world.workers);
}

void CellLayer::update(const trace::Change& change) {
  coverage.update(world.scene, *world.caster, division, change, world.workers);
}

void CellLayer::touch_all() { std::fill(sums.touched.begin(), sums.touched.end(), uint8_t(1)); }

void CellLayer::renew_light() {
  const std::vector<double> units = world.cell_units();
  std::vector<double> caustics;
  if (world.has_caustics()) caustics = world.cell_units(true);
  gather::CellState now = state(units);
  now.caustic_units = caustics;
  light.renew(now, world.workers);
}

Vec3d CellLayer::power_of_one_path() const {
  Vec3d most{};
  for (const trace::Light& own : world.lights) {
    if (!own.on || own.path_count == 0 || own.map || own.aims) continue;
    const double factor = world.group_factor[own.group] / double(own.path_count);
    for (int c = 0; c < 3; ++c) most[c] = std::max(most[c], factor * own.power[c]);
  }
  const double metre = double(division.metre());
  return most * (1 / (kRoom * metre * metre));
}

bool CellLayer::is_lit(uint32_t cell) const {
  for (uint32_t g = 0; g < sums.groups; ++g)
    for (uint32_t k = 0; k < sums.batches; ++k)
      for (size_t c = 0; c < 3; ++c)
        if (sums.quanta[sums.at(cell, g, k) + c]) return true;
  return false;
}

bool CellLayer::are_sums_possible() const {
  return std::all_of(sums.quanta.begin(), sums.quanta.end(), [](int64_t sum) { return sum >= 0; });
}

void CellLayer::digest(Lanes& lanes) const {
  if (!world.gathers()) return;
  lanes.chain(bits(division.metre()));
  for (uint32_t cell = 0; cell < division.size(); ++cell) {
    lanes.chain(bits(division.area(cell)) << 32 | division.material(cell));
    lanes.chain(division.tint(cell));
  }
  lanes.chain_all(sums.quanta);
  lanes.chain_all(coverage.covered());
}

}  // namespace deltalux::session
