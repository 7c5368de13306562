// SPDX-License-Identifier: Apache-2.0
// Directions of samples: cosine-distributed, and those towards a ball are found without a miss.
#include "gather/aim/directions.h"

#include <gtest/gtest.h>

#include <cmath>

namespace deltalux::gather {
namespace {

Vec3f random_direction(uint32_t i, uint64_t seed) {
  const auto r = sobol::sample(i, seed);
  const float z = 2 * r[0] - 1, flat = std::sqrt(1 - z * z), phi = 6.2831853f * r[1];
  return {flat * std::cos(phi), z, flat * std::sin(phi)};
}

TEST(Directions, AreDistributedAsTheCosine) {
  for (const uint32_t count : {64u, 100u, 256u}) {
    const Directions directions(count, 3);
    for (uint32_t sample = 0; sample < 50; ++sample) {
      const Vec3f n = random_direction(sample, 5);
      Vec3d sum{};
      for (uint32_t ray = 0; ray < count; ++ray) {
        const Vec3f w = directions(sample, ray, n);
        EXPECT_NEAR(length(w), 1, 1e-5);
        EXPECT_GE(dot(w, n), 0);
        sum = sum + Vec3d(w) * (1.0 / count);
      }
      // The mean of cosine-distributed directions is 2/3 n.
      EXPECT_LT(length(sum - Vec3d(n) * (2.0 / 3)), 0.1) << count;
    }
  }
}

TEST(Directions, TowardsABallAreAllFoundAndFewOthers) {
  uint64_t hit = 0, visited = 0, all = 0;
  for (const uint32_t count : {16u, 128u, 200u}) {
    const Directions directions(count, 11);
    for (uint32_t sample = 0; sample < 3000; ++sample) {
      const Vec3f n = random_direction(sample, 5);
      const float distance = 0.05f + 4 * sobol::sample(sample, 8)[0];
      const Vec3f to_centre = random_direction(sample, 6) * distance;
      const float radius = 0.02f + sobol::sample(sample, 8)[1];
      std::vector<uint8_t> found(count);
      directions.each_towards(sample, count, n, to_centre, radius, [&](uint32_t ray) {
        EXPECT_FALSE(found[ray]) << "twice";
        found[ray] = 1;
      });
      for (uint32_t ray = 0; ray < count; ++ray) {
        const Vec3f w = directions(sample, ray, n);
        const float along = dot(to_centre, w);
        const float nearest = dot(to_centre, to_centre) - along * along;
        const bool meets = distance <= radius || (along > 0 && nearest <= radius * radius);
        EXPECT_TRUE(found[ray] || !meets) << sample << " " << ray;
        hit += meets, visited += found[ray], ++all;
      }
    }
  }
  EXPECT_LT(visited, hit + all / 8);
}

}  // namespace
}  // namespace deltalux::gather
