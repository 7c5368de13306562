// SPDX-License-Identifier: Apache-2.0
// Standard errors of gathered light, evened out among neighbours: they see the same bright places,
// and a sample whose own rays missed one would claim next to no error.
#pragma once
#include <cstdint>
#include <span>

#include "base/vec.h"

namespace deltalux::gather {

/// A sample with its gathered light, all channels.
struct Estimate {
  Vec3f point{}, normal{};
  uint32_t object = 0;
  uint32_t rays = 0;
  double irradiance[3] = {}, error[3] = {};
};

/// Samples in an order in which neighbours lie close to each other; pools those within a quarter
/// `metre`. What is dark keeps its error.
void pool_errors(std::span<Estimate> samples, double metre);

}  // namespace deltalux::gather
