// SPDX-License-Identifier: Apache-2.0
// Errors of neighbours, and of all that may miss what a few lucky rays found.
#include "gather/hits/pool_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace deltalux::gather {
namespace {

constexpr double kError = 0.02;  // that each sample claims by itself
constexpr uint32_t kRays = 256;

Estimate sample(Vec3f point, Vec3f normal, double lucky = 0) {
  Estimate out;
  out.point = point, out.normal = normal, out.rays = kRays;
  for (size_t c = 0; c < 3; ++c) {
    out.light.irradiance[c] = 10;
    out.light.error[c] = 10 * kError;
    out.light.lucky[c] = 100 * lucky;
  }
  return out;
}

/// Forty samples of a ceiling, each 1 m from the next, of which the first are lucky.
std::vector<Estimate> ceiling(size_t lucky, double variance) {
  std::vector<Estimate> out;
  for (size_t i = 0; i < 40; ++i)
    out.push_back(sample({float(i), 3.0f, 0}, {0, -1, 0}, i < lucky ? variance : 0));
  return out;
}

double relative_error(const Estimate& own) { return own.light.error[0] / own.light.irradiance[0]; }

TEST(PoolErrors, AllOfASurfaceAllowForLuckyRays) {
  std::vector<Estimate> samples = ceiling(5, 0.04);
  samples.push_back(sample({20, 0.7f, 0}, {0, -1, 0}));  // a table's underside
  samples.push_back(sample({20, 3, 0}, {1, 0, 0}));      // a wall
  pool_errors(samples, 1);
  const double expected = std::sqrt(4 * 0.04 / 40);  // the luckiest is left out
  for (size_t i = 0; i < 40; ++i) EXPECT_NEAR(relative_error(samples[i]), expected, 1e-9);
  EXPECT_NEAR(relative_error(samples[40]), kError, 1e-9);
  EXPECT_NEAR(relative_error(samples[41]), kError, 1e-9);
}

TEST(PoolErrors, OneLuckySampleTellsNothingOfOthers) {
  std::vector<Estimate> samples = ceiling(1, 0.5);
  pool_errors(samples, 1);
  for (const Estimate& own : samples) EXPECT_NEAR(relative_error(own), kError, 1e-9);
}

TEST(PoolErrors, LuckNeverLowersAnError) {
  std::vector<Estimate> samples = ceiling(40, 1e-6);
  pool_errors(samples, 1);
  for (const Estimate& own : samples) EXPECT_NEAR(relative_error(own), kError, 1e-9);
}

TEST(PoolErrors, MoreRaysAreLessLucky) {
  std::vector<Estimate> samples = ceiling(20, 0.04);
  for (size_t i = 20; i < 40; ++i) samples[i].rays = 4 * kRays;
  pool_errors(samples, 1);
  EXPECT_NEAR(relative_error(samples[0]), 2 * relative_error(samples[39]), 1e-9);
}

}  // namespace
}  // namespace deltalux::gather
