// SPDX-License-Identifier: Apache-2.0
// BrightnessSurvey for bright places: a few rays each from places on lit cells, and what they hit.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "gather/choose/lit_cells.h"
#include "gather/hits/chain.h"
#include "gather/hits/evaluate.h"

namespace deltalux::gather {

/// What a ray hit, or would hit with some probability.
struct BrightHit {
  static constexpr float kBright = 3;  ///< times the mean radiosity that the place's rays hit
  Vec3f at, normal;
  uint32_t cell;
  float radiosity, around;
  double weight;  ///< share of the place's variance, times the probability
  bool bright() const { return radiosity > kBright * around; }
};

/// All hits of the scene.
struct BrightnessSurvey {
  static constexpr size_t kMinBright = 3;    ///< for a guide
  static constexpr double kMinShare = 0.01;  ///< of the variance, for a place to be worth one

  BrightnessSurvey(const Context& context, const Evaluation& evaluation, const LitCells& lit,
                   uint64_t seed, const Workers& workers, Progress& progress);
  /// Whether a place with `count` hits, `bright` of them bright and of total weight `weight`, is
  /// bright to most that see it, and worth a guide in view of the remaining variance.
  static bool suffice(size_t bright, size_t count, double weight, double variance) {
    return bright >= kMinBright && 2 * bright >= count && weight > kMinShare * variance;
  }

  std::vector<BrightHit> all;  ///< bright ones first; then by descending weight
  double variance = 0;         ///< sum of all weights
  std::vector<uint32_t> hits;  ///< by cell: number of rays that hit it
};

/// The value below which this share of the values lies; reorders them.
float quantile(std::vector<float>& values, double share);

}  // namespace deltalux::gather
