// SPDX-License-Identifier: Apache-2.0
// What a pilot of few rays from some of the lit cells tells of bright places.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "gather/chain.h"
#include "gather/evaluate.h"
#include "gather/lit_cells.h"

namespace deltalux::gather {

/// What a ray of a pilot met, or would meet by some chance.
struct Vote {
  static constexpr float kBright = 3;  ///< times the mean of a pilot's rays
  Vec3f at, normal;
  uint32_t cell;
  float radiosity, around;
  double weight;  ///< share of its pilot's variance, times the chance
  bool bright() const { return radiosity > kBright * around; }
};

struct Votes {
  static constexpr size_t kMinBright = 3;    ///< for a guide
  static constexpr double kMinShare = 0.01;  ///< of the variance, for a place to be worth one

  Votes(const Present& present, const Evaluation& evaluation, const LitCells& lit, uint64_t seed,
        const Workers& workers, Progress& progress);
  /// Whether `bright` ones of `count`, of that weight together, are bright to most who see them,
  /// and worth a guide beside the variance that is left.
  static bool suffice(size_t bright, size_t count, double weight, double variance) {
    return bright >= kMinBright && 2 * bright >= count && weight > kMinShare * variance;
  }

  std::vector<Vote> all;       ///< bright ones first, of these and of the others the heaviest
  double variance = 0;         ///< sum of their weights
  std::vector<uint32_t> hits;  ///< per cell: rays of pilots that met it
};

/// The value that this share of them lies below; reorders them.
float quantile(std::vector<float>& values, double share);

}  // namespace deltalux::gather
