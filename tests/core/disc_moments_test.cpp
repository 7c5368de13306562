// SPDX-License-Identifier: Apache-2.0
// Closed forms of polynomials over polygons clipped to the unit disc, against sums over a fine
// grid.
#include "estimate/disc_moments.h"

#include <gtest/gtest.h>

#include <array>

#include "base/random.h"

namespace deltalux::estimate {
namespace {

using Corner = std::array<double, 2>;
constexpr double kPi = 3.14159265358979323846;

DiscMoments moments_of(const std::vector<Corner>& polygon) {
  DiscMoments m;
  for (size_t k = 0; k < polygon.size(); ++k) {
    const Corner &p = polygon[k], &q = polygon[(k + 1) % polygon.size()];
    m.add_edge(p[0], p[1], q[0], q[1]);
  }
  return m;
}

TEST(DiscMoments, WholeDiscInsideAPolygon) {
  const DiscMoments m = moments_of({{-9, -7}, {8, -6}, {3, 20}});
  EXPECT_NEAR(m.area(), kPi, 1e-12);
  EXPECT_NEAR(m.plain[1], 0, 1e-12);
  EXPECT_NEAR(m.plain[3], kPi / 4, 1e-12);
  EXPECT_NEAR(m.plain[4], 0, 1e-12);
  EXPECT_NEAR(m.squared[0], kPi / 2, 1e-12);
  EXPECT_NEAR(m.squared[5], kPi / 6, 1e-12);
}

TEST(DiscMoments, HalfAndQuarterDiscsWithTheCentreOnTheBorder) {
  const DiscMoments half = moments_of({{-5, 0}, {5, 0}, {5, 5}, {-5, 5}});
  EXPECT_NEAR(half.area(), kPi / 2, 1e-12);
  EXPECT_NEAR(half.plain[2], 2.0 / 3, 1e-12);
  EXPECT_NEAR(half.squared[2], 2.0 / 5, 1e-12);
  const DiscMoments quarter = moments_of({{0, 0}, {5, 0}, {0, 5}});
  EXPECT_NEAR(quarter.area(), kPi / 4, 1e-12);
  EXPECT_NEAR(quarter.plain[4], 1.0 / 8, 1e-12);
}

TEST(DiscMoments, PolygonInsideTheDiscAndPolygonsOutside) {
  const DiscMoments square = moments_of({{0.1, 0.1}, {0.5, 0.1}, {0.5, 0.5}, {0.1, 0.5}});
  EXPECT_NEAR(square.area(), 0.16, 1e-14);
  EXPECT_NEAR(square.plain[1], 0.16 * 0.3, 1e-14);
  EXPECT_NEAR(square.plain[4], 0.16 * 0.09, 1e-14);
  const DiscMoments outside = moments_of({{1.5, -1}, {3, -1}, {2, 4}});
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(outside.plain[k], 0, 1e-12);
}

TEST(DiscMoments, RandomTriangles) {
  constexpr int kCells = 1000;
  for (uint64_t trial = 0; trial < 20; ++trial) {
    const PathRandom random(5, trial);
    std::array<Corner, 3> t;
    for (uint32_t k = 0; k < 3; ++k) t[k] = {3 * random(k, 0) - 1.5, 3 * random(k, 1) - 1.5};
    const auto side = [](const Corner& a, const Corner& b, double u, double v) {
      return (b[0] - a[0]) * (v - a[1]) - (b[1] - a[1]) * (u - a[0]);
    };
    if (side(t[0], t[1], t[2][0], t[2][1]) < 0) std::swap(t[1], t[2]);
    double plain[6] = {}, squared[6] = {};
    for (int i = 0; i < kCells; ++i)
      for (int j = 0; j < kCells; ++j) {
        const double u = 2 * (i + 0.5) / kCells - 1, v = 2 * (j + 0.5) / kCells - 1;
        const double r2 = u * u + v * v;
        if (r2 >= 1 || side(t[0], t[1], u, v) < 0 || side(t[1], t[2], u, v) < 0 ||
            side(t[2], t[0], u, v) < 0)
          continue;
        const double value[6] = {1, u, v, u * u, u * v, v * v};
        for (int k = 0; k < 6; ++k) {
          plain[k] += value[k] * 4 / (kCells * kCells);
          squared[k] += value[k] * r2 * 4 / (kCells * kCells);
        }
      }
    const DiscMoments m = moments_of({t[0], t[1], t[2]});
    for (int k = 0; k < 6; ++k) {
      EXPECT_NEAR(m.plain[k], plain[k], 2e-3) << "trial " << trial << ", moment " << k;
      EXPECT_NEAR(m.squared[k], squared[k], 2e-3) << "trial " << trial << ", moment " << k;
    }
  }
}

}  // namespace
}  // namespace deltalux::estimate
