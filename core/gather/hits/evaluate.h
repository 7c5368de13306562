// SPDX-License-Identifier: Apache-2.0
// Computes irradiance from cells' sums and samples' gather rays: a pure function, in a fixed order.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "gather/hits/cell_light.h"
#include "gather/hits/gather_hits.h"
#include "gather/hits/sample_light.h"

namespace deltalux::gather {

class Evaluation {
 public:
  /// `light`, and all hits to be read, must be up to date with this state. Without errors, reading
  /// takes half of the time.
  Evaluation(const CellState& state, const CellLight& light, Paint paint, bool errors,
             const Workers& workers);
  /// Power per square metre of a room that one more path would bring to it, per channel: where few
  /// batches brought light, or most cells have none, errors allow for that.
  void allow_for(Vec3d one_path) { one_path_ = one_path; }
  /// Sum of a cell's radiosity in all channels.
  float brightness(uint32_t cell) const;
  /// Factor for the light's power.
  float dim(uint32_t light) const { return paint_.dim[light]; }
  /// The paint that hits need before they are read, see GatherHits::paint().
  const Paint& paint() const { return paint_; }
  /// Learns from some samples how much smaller the variance of all their rays is than the variance
  /// of parts of them suggests. Low-discrepancy sequences converge faster than independent samples,
  /// so that the claimed error would be too large otherwise.
  void learn_spread(const GatherHits& hits);
  SampleLight read(const GatherHits& hits, size_t sample) const;
  /// Mean and variance of a sample's pilot rays, without direct light.
  PilotEstimate pilot(const GatherHits& hits, size_t sample) const;

 private:
  /// The gathered light of a sample, by part of its rays and by batch of paths. Each part is a
  /// contiguous piece of the Sobol' sequence, evenly distributed by itself; there are as many
  /// batches as parts.
  struct Table {
    float sums[kParts][3][kParts] = {};
    float parts[kParts][3];  ///< by part of the rays, for all batches together
    float most[kParts][3];   ///< that one ray of the part brings
    double whole[3] = {};
    size_t rays[kParts];
    size_t chains = 0;
    size_t unlit = 0;  ///< rays that end on cells without light
    /// Means of a channel, by part and batch.
    void means(size_t channel, double (&out)[kParts][kParts]) const;
    /// Variance from the luckiest ray of each part, as if its place were hit at random.
    double lucky_variance(size_t channel, size_t count) const;
  };
  template <bool kErrors>
  void add(const GatherHits& hits, size_t sample, Table& table) const;
  /// Samples are classified by their share of chains, since chains are random and rays evenly
  /// distributed.
  static constexpr size_t kKinds = 3;
  static size_t kind_of(const Table& table, size_t rays);

  /// What all reflections of one more path bring to a room whose surfaces are like those that a
  /// sample's rays meet.
  Vec3d unseen(const GatherHits& hits, size_t sample) const;

  const Cells* cells_;
  const CellLight* light_;
  Paint paint_;
  std::array<double, 3> mean_radiosity_{};  // weighted by area, for errors
  Vec3d one_path_{};
  // by class: variance of all rays over that estimated from parts
  std::array<double, kKinds> evenness_{1, 1, 1};
  std::vector<CellBatches> batches_;  // by cell; empty without errors
};

}  // namespace deltalux::gather
