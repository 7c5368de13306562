// SPDX-License-Identifier: Apache-2.0
// Pools standard errors of gathered light among neighbouring samples: these see the same bright
// places, and a sample whose own rays missed one would claim almost no error.
#pragma once
#include <cstdint>
#include <span>

#include "base/vec.h"
#include "gather/hits/sample_light.h"

namespace deltalux::gather {

/// A sample with its gathered light, by channel.
struct Estimate {
  Vec3f point{}, normal{};
  uint32_t object = 0;
  uint32_t rays = 0;
  SampleLight light;
};

/// Pools the errors of samples within half a `metre` whose light is of comparable size, and the
/// variance from lucky rays of all on one surface. Samples must be in an order in which neighbours
/// are close together. Dark samples keep their errors.
void pool_errors(std::span<Estimate> samples, double metre);

}  // namespace deltalux::gather
