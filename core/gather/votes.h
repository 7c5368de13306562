// SPDX-License-Identifier: Apache-2.0
// What a pilot of few rays from some of the lit cells tells of bright places.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "gather/chain.h"
#include "gather/evaluate.h"

namespace deltalux::gather {

/// What a ray of a pilot met.
struct Vote {
  static constexpr float kBright = 3;  ///< times the mean of a pilot's rays
  Vec3f at, normal;
  uint32_t cell;
  float radiosity, around;
  double weight;  ///< share of its pilot's variance
  bool bright() const { return radiosity > kBright * around; }
};

struct Votes {
  static constexpr size_t kLeast = 3;           ///< for a guide
  static constexpr double kLeastShare = 0.003;  ///< of the variance, for a place to be worth one

  /// `covered`: of Coverage.
  Votes(const Present& present, const Evaluation& evaluation, std::span<const uint16_t> covered,
        uint64_t seed, const Workers& workers, Progress& progress);
  /// Whether `bright` ones of `count`, of that weight together, are bright to most who see them.
  bool suffice(size_t bright, size_t count, double weight) const {
    return bright >= kLeast && 2 * bright >= count && weight > kLeastShare * variance;
  }

  std::vector<Vote> all;  ///< the heaviest first
  double variance = 0;    ///< sum of their weights
};

/// Some of the places where light falls, in the middle of things, wherever samples are.
std::vector<direct::Receiver> lit_places(const Present& present, const Evaluation& evaluation,
                                         std::span<const uint16_t> covered);

float median(std::vector<float>& values);

}  // namespace deltalux::gather
