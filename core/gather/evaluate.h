// SPDX-License-Identifier: Apache-2.0
// From sums of cells and what samples see to irradiance: a pure function, in a fixed order.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "gather/coverage.h"
#include "gather/looks.h"

namespace deltalux::gather {

/// Sums of landed energy in quanta: [((cell * groups) + group) * batches + batch) * 3 + channel].
struct CellSums {
  std::vector<int64_t> quanta;
  uint32_t groups = 1, batches = 1;
  size_t at(uint32_t cell, uint32_t group, uint32_t batch) const {
    return 3 * ((size_t(cell) * groups + group) * batches + batch);
  }
};

/// What turns sums into light.
struct Scales {
  double quantum;                  ///< power per quantum
  std::vector<double> sum_factor;  ///< per group of the sums
  std::vector<double> dim_factor;  ///< per light group
};

class Evaluation {
 public:
  Evaluation(const scene::Scene& scene, std::span<const trace::Light> lights, const Cells& cells,
             const Coverage& coverage, const CellSums& sums, const Scales& scales,
             const Workers& workers);
  /// Sum of a cell's radiosity in all channels.
  float brightness(uint32_t cell) const;
  /// Irradiance of a sample and its standard error, 3 each.
  void read(const Looks& looks, size_t sample, double* irradiance, double* error) const;

 private:
  /// Adds `weight` times what `target` sends, per batch and in all: (kParts + 1) x 4. There are as
  /// many batches of paths as parts of the rays.
  void add(const ChainPool& chains, uint32_t target, float weight, float* sums) const;

  const scene::Scene& scene_;
  std::span<const trace::Light> lights_;
  Scales scales_;
  std::array<double, 3> mean_radiosity_{};  // by area
  std::vector<float> radiosity_;            // per cell: (kParts + 1) x 4; part k is 8 times batch k
};

}  // namespace deltalux::gather
