// SPDX-License-Identifier: Apache-2.0
// From sums of cells and what samples see to irradiance: a pure function, in a fixed order.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "gather/cell_light.h"
#include "gather/looks.h"

namespace deltalux::gather {

class Evaluation {
 public:
  /// `light` and all looks that it reads: renewed for this state. Without errors half of the time
  /// is enough.
  Evaluation(const CellState& state, const CellLight& light, Paint paint, bool errors,
             const Workers& workers);
  /// Sum of a cell's radiosity in all channels.
  float brightness(uint32_t cell) const;
  /// What the light's power is multiplied by.
  float dim(uint32_t light) const { return paint_.dim[light]; }
  /// What looks have to be painted with before they are read.
  const Paint& paint() const { return paint_; }
  /// Learns from some of the samples how much more evenly their rays are spread than parts of them
  /// are, which would claim too much error.
  void learn_spread(const Looks& looks);
  /// Irradiance of a sample and, of an evaluation with errors, its standard error, 3 each.
  void read(const Looks& looks, size_t sample, double* irradiance, double* error) const;
  /// What the rays of a sample tell about it, without direct light.
  PilotLook pilot(const Looks& looks, size_t sample) const;

 private:
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

  const CellLight* light_;
  Paint paint_;
  std::array<double, 3> mean_radiosity_{};        // by area, for errors
  std::array<double, kKinds> evenness_{1, 1, 1};  // variance of rays, of that of their parts
  std::vector<CellBatches> batches_;              // per cell; empty without errors
};

}  // namespace deltalux::gather
