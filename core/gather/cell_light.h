// SPDX-License-Identifier: Apache-2.0
// Radiosity of the cells: from sums of landed energy, a pure function of each cell's own.
#pragma once
#include <array>
#include <vector>

#include "base/parallel.h"
#include "gather/coverage.h"
#include "gather/sample_rays.h"

namespace deltalux::gather {

/// Sums of landed energy in quanta: [((cell * groups) + group) * batches + batch) * 3 + channel].
struct CellSums {
  std::vector<int64_t> quanta;
  std::vector<uint8_t> touched;  ///< per cell: whether they changed since CellLight was renewed
  uint32_t groups = 1, batches = 1;
  size_t at(uint32_t cell, uint32_t group, uint32_t batch) const {
    return 3 * ((size_t(cell) * groups + group) * batches + batch);
  }
  size_t bytes() const { return quanta.capacity() * sizeof(int64_t) + touched.capacity(); }
};

/// What turns sums into light.
struct Scales {
  double quantum = 0;              ///< power per quantum
  std::vector<double> sum_factor;  ///< per group of the sums
};

/// What radiosity is made of.
struct CellState {
  const scene::Scene& scene;
  const Cells& cells;
  const Coverage& coverage;
  CellSums& sums;
  const Scales& scales;
};

/// Kept between readings, so that an edit costs what it touched.
class CellLight {
 public:
  using Radiosity = std::array<float, 3>;
  /// Takes in what changed, all of it after a change of scales or reflectances.
  void renew(const CellState& state, const Workers& workers);
  const Radiosity& operator[](uint32_t cell) const { return radiosity_[cell]; }
  static size_t forecast_bytes(size_t cells) { return cells * (sizeof(Radiosity) + sizeof(float)); }
  size_t bytes() const {
    return radiosity_.capacity() * sizeof(Radiosity) + bare_.capacity() * sizeof(float);
  }

 private:
  std::vector<Radiosity> radiosity_;
  std::vector<float> bare_;  // per cell: Coverage::bare of then
  std::vector<Vec3f> reflectance_;
  std::vector<double> factor_;
};

/// Radiosity of a cell by each batch of paths, times their number, in steps: rounding is the least
/// of the noise, and one look-up meets one line of the cache.
struct alignas(64) CellBatches {
  uint16_t steps[3][kParts];
  float step;
};
std::vector<CellBatches> batches_of(const CellState& state, const Workers& workers);

}  // namespace deltalux::gather
