// SPDX-License-Identifier: Apache-2.0
// Radiosity of the cells: a pure function of each cell's sum of landed power.
#pragma once
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "base/assertion.h"
#include "base/parallel.h"
#include "gather/aim/sample_rays.h"
#include "gather/cells/coverage.h"

namespace deltalux::gather {

/// Sums of landed power in quanta: [(((cell * groups) + group) * batches + batch) * 3 + channel].
struct CellSums {
  std::vector<int64_t> quanta;
  std::vector<uint8_t> touched;  ///< by cell: whether it changed since the last CellLight::renew()
  uint32_t groups = 1, batches = 1;
  size_t at(uint32_t cell, uint32_t group, uint32_t batch) const {
    DELTALUX_ASSERT(group < groups && batch < batches);
    return 3 * ((size_t(cell) * groups + group) * batches + batch);
  }
  /// Changes the number of groups. New ones have no power yet; those that are dropped must have
  /// none.
  void set_groups(uint32_t count);
  size_t bytes() const { return quanta.capacity() * sizeof(int64_t) + touched.capacity(); }
};
/// Lays out sums that are ordered as CellSums::quanta for another number of groups. Allocates no
/// memory where the number does not grow.
void regroup(std::vector<int64_t>& quanta, uint32_t batches, uint32_t from, uint32_t to);

/// All that radiosity depends on.
struct CellState {
  const scene::Scene& scene;
  const Cells& cells;
  const Coverage& coverage;
  CellSums& sums;
  std::span<const double> units;  ///< present power per quantum, by group of the sums
  /// The same of caustics alone; empty where cells do not sum these.
  std::span<const double> caustic_units{};
};

/// The radiosity of all cells, kept between reads, so that an update costs only what it changed.
class CellLight {
 public:
  using Radiosity = std::array<float, 3>;
  /// Recomputes the radiosity of changed cells, or of all cells after a change of units or
  /// reflectances.
  void renew(const CellState& state, const Workers& workers);
  const Radiosity& operator[](uint32_t cell) const { return radiosity_[cell]; }
  /// Irradiance by caustics alone, by cell; empty where cells do not sum these.
  const std::vector<Radiosity>& caustics() const { return caustics_; }
  static size_t forecast_bytes(size_t cells) { return cells * (sizeof(Radiosity) + sizeof(float)); }
  size_t bytes() const {
    return (radiosity_.capacity() + caustics_.capacity()) * sizeof(Radiosity) +
           bare_.capacity() * sizeof(float);
  }

 private:
  std::vector<Radiosity> radiosity_, caustics_;
  std::vector<float> bare_;  // by cell: the value of Coverage::bare at the last renewal
  std::vector<Vec3f> reflectance_;
  std::vector<double> units_;
};

/// A cell's radiosity as estimated by each batch of paths, in integer steps. Rounding errors are
/// far below the noise, and one look-up touches one cache line.
struct alignas(64) CellBatches {
  uint16_t steps[3][kParts];
  float step;
};
/// The estimates of all cells.
std::vector<CellBatches> batches_of(const CellState& state, const Workers& workers);

}  // namespace deltalux::gather
