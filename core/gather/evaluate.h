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
  /// Without errors half of the time is enough.
  Evaluation(const scene::Scene& scene, std::span<const trace::Light> lights, const Cells& cells,
             const Coverage& coverage, const CellSums& sums, const Scales& scales, bool errors,
             const Workers& workers);
  /// Sum of a cell's radiosity in all channels.
  float brightness(uint32_t cell) const;
  /// What the light's power is multiplied by.
  float dim(uint32_t light) const { return dim_[light]; }
  /// Learns from some of the samples how much more evenly their rays are spread than parts of them
  /// are, which would claim too much error.
  void learn_spread(const Looks& looks);
  /// Irradiance of a sample and, of an evaluation with errors, its standard error, 3 each.
  void read(const Looks& looks, size_t sample, double* irradiance, double* error) const;
  /// What the rays of a sample tell about it, without direct light.
  PilotLook pilot(const Looks& looks, size_t sample) const;

 private:
  /// Radiosity of a cell. `step`: of its batches.
  struct Whole {
    float channel[3];
    float step;
  };
  /// The same by each batch of paths, times their number, in steps: rounding is the least of the
  /// noise, and one look-up meets one line of the cache.
  struct alignas(64) Batches {
    uint16_t steps[3][kParts];
  };
  /// What a chain sends: from its own lights, and how much of its end's radiosity.
  struct Carried {
    float direct[3], through[3];
  };
  Carried carried(const ChainPool& chains, uint32_t number, float weight) const;
  /// A sample by part of its rays and batch of the paths. Each part is a run of the Sobol'
  /// sequence, evenly spread by itself; there are as many batches as parts.
  struct Table {
    float sums[kParts][3][kParts] = {};
    float parts[kParts][3];  ///< of the rays, all batches
    double whole[3] = {};
    size_t rays[kParts];
    size_t chains = 0;
    /// Means of a channel by part and batch.
    void means(size_t channel, double (&out)[kParts][kParts]) const;
  };
  template <bool kErrors>
  void add(const Looks& looks, size_t sample, Table& table) const;
  /// Chains are drawn at random, rays evenly: by their share.
  static constexpr size_t kKinds = 3;
  static size_t kind_of(const Table& table, size_t rays);

  std::vector<Vec3f> reflectance_;                // per material
  std::vector<float> dim_;                        // per light; the last one is of none
  std::array<double, 3> mean_radiosity_{};        // by area, for errors
  std::array<double, kKinds> evenness_{1, 1, 1};  // variance of rays, of that of their parts
  std::vector<Whole> whole_;                      // per cell
  std::vector<Batches> batches_;                  // per cell
};

}  // namespace deltalux::gather
