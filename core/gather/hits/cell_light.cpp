// SPDX-License-Identifier: Apache-2.0
// Computes the cells' radiosity from sums of landed power.
#include "gather/hits/cell_light.h"

#include <algorithm>
#include <cmath>

namespace deltalux::gather {
namespace {

constexpr size_t kGrain = 1024;
constexpr double kSteps = 65535;

/// Landed power, for these units of the groups.
double landed(const CellState& state, std::span<const double> units, uint32_t cell, uint32_t batch,
              size_t channel) {
  double sum = 0;
  for (uint32_t g = 0; g < state.sums.groups; ++g)
    sum += units[g] * double(state.sums.quanta[state.sums.at(cell, g, batch) + channel]);
  return sum;
}

/// The area on which light lands.
double bare_area(const CellState& state, uint32_t cell, float bare) {
  return double(state.cells.area(cell)) * double(bare);
}

/// Radiosity per landed power; 0 for a cell without area.
Vec3d unit_of(const CellState& state, uint32_t cell, float bare) {
  const double area = bare_area(state, cell, bare);
  if (!(area > 0)) return {};
  const Vec3f reflectance =
      state.cells.reflectance(cell, state.scene.materials[state.cells.material(cell)]);
  Vec3d unit;
  for (int c = 0; c < 3; ++c) unit[c] = double(reflectance[c]) / area;
  return unit;
}

/// Irradiance by caustics; 0 for a cell without area.
CellLight::Radiosity caustic(const CellState& state, uint32_t cell, float bare) {
  const double area = bare_area(state, cell, bare);
  CellLight::Radiosity out{};
  if (!(area > 0)) return out;
  for (size_t c = 0; c < 3; ++c) {
    double sum = 0;
    for (uint32_t k = 0; k < kParts; ++k) sum += landed(state, state.caustic_units, cell, k, c);
    out[c] = float(sum / area);
  }
  return out;
}

}  // namespace

void regroup(std::vector<int64_t>& quanta, uint32_t batches, uint32_t from, uint32_t to) {
  const size_t old_row = 3 * size_t(batches) * from, row = 3 * size_t(batches) * to;
  const size_t cells = quanta.size() / old_row;
  DELTALUX_ASSERT(quanta.size() == cells * old_row);
  const auto at = [&](size_t i) { return quanta.begin() + long(i); };
  if (row > old_row) {
    quanta.resize(cells * row);
    for (size_t cell = cells; cell-- > 0;) {  // from behind, so that none is overwritten
      std::copy_backward(at(cell * old_row), at((cell + 1) * old_row), at(cell * row + old_row));
      std::fill(at(cell * row + old_row), at((cell + 1) * row), 0);
    }
  } else if (row < old_row) {
    for (size_t cell = 0; cell < cells; ++cell)
      std::copy(at(cell * old_row), at(cell * old_row + row), at(cell * row));
    quanta.resize(cells * row);
  }
}

void CellSums::set_groups(uint32_t count) {
  regroup(quanta, batches, groups, count);
  groups = count;
}

void CellLight::renew(const CellState& state, const Workers& workers) {
  const size_t count = state.cells.size();
  std::vector<Vec3f> reflectance;
  for (const scene::Material& material : state.scene.materials)
    reflectance.push_back(material.reflectance);
  std::vector<double> units(state.units.begin(), state.units.end());
  const bool all = reflectance != reflectance_ || units != units_;
  if (all) reflectance_.clear();  // if memory runs out below, the next call renews all cells
  radiosity_.resize(count);
  caustics_.resize(state.caustic_units.empty() ? 0 : count);
  bare_.resize(count);
  workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t cell = uint32_t(i);
      const float bare = state.coverage.bare(cell);
      if (!all && !state.sums.touched[i] && bare == bare_[i]) continue;
      const Vec3d unit = unit_of(state, cell, bare);
      for (size_t c = 0; c < 3; ++c) {
        double sum = 0;
        for (uint32_t k = 0; k < kParts; ++k) sum += landed(state, state.units, cell, k, c);
        radiosity_[i][c] = float(sum * unit[int(c)]);
      }
      if (!caustics_.empty()) caustics_[i] = caustic(state, cell, bare);
      bare_[i] = bare;
      state.sums.touched[i] = 0;
    }
  });
  reflectance_ = std::move(reflectance);
  units_ = std::move(units);
}

std::vector<CellBatches> batches_of(const CellState& state, const Workers& workers) {
  std::vector<CellBatches> out(state.cells.size());
  workers.for_blocks(out.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t cell = uint32_t(i);
      const Vec3d unit = unit_of(state, cell, state.coverage.bare(cell));
      double batch[3][kParts], most = 0;
      for (size_t c = 0; c < 3; ++c)
        for (uint32_t k = 0; k < kParts; ++k)
          most = std::max(
              most, batch[c][k] = landed(state, state.units, cell, k, c) * unit[int(c)] * kParts);
      if (!(most > 0) || !std::isfinite(most)) continue;
      out[i].step = float(most / kSteps);
      for (size_t c = 0; c < 3; ++c)
        for (size_t k = 0; k < kParts; ++k)
          out[i].steps[c][k] = uint16_t(kSteps * (batch[c][k] / most) + 0.5);
    }
  });
  return out;
}

}  // namespace deltalux::gather
