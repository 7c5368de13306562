// SPDX-License-Identifier: Apache-2.0
// Curves: the Hilbert curve steps from cell to neighbouring cell, the Lebesgue curve is z-order.
#include "base/curve_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace deltalux::samples {
namespace {

/// One point in each cell of a grid; shuffled by a step that is prime to their number.
std::vector<Vec3f> grid(int side) {
  const int count = side * side * side;
  std::vector<Vec3f> points;
  for (int i = 0, k = 0; i < count; ++i, k = (k + 4099) % count)
    points.push_back({float(k % side), float(k / side % side), float(k / side / side)});
  return points;
}

TEST(CurveOrder, HilbertGoesFromCellToNeighbour) {
  for (const int side : {2, 4, 16, 32}) {
    const std::vector<Vec3f> points = grid(side);
    const std::vector<uint32_t> order = curve_order(points, Curve::hilbert);
    std::vector<int> seen(points.size(), 0);
    for (size_t i = 0; i < order.size(); ++i) {
      ++seen[order[i]];
      if (i == 0) continue;
      const Vec3f step = points[order[i]] - points[order[i - 1]];
      ASSERT_EQ(std::fabs(step.x) + std::fabs(step.y) + std::fabs(step.z), 1.0f)
          << side << ' ' << i;
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), long(points.size()));
  }
}

TEST(CurveOrder, LebesgueTakesAnOctantAfterTheOther) {
  const std::vector<Vec3f> points = grid(4);
  const std::vector<uint32_t> order = curve_order(points, Curve::lebesgue);
  for (size_t i = 0; i < order.size(); ++i) {
    const auto cell = [&](float x) { return size_t(x); };
    const Vec3f p = points[order[i]];
    size_t key = 0;
    for (const int bit : {1, 0})
      for (const float x : {p.x, p.y, p.z}) key = 2 * key + (cell(x) >> bit & 1);
    EXPECT_EQ(key, i);
  }
}

TEST(CurveOrder, EqualPlacesKeepTheirOrder) {
  const std::vector<Vec3f> points{{1, 1, 1}, {0, 0, 0}, {1, 1, 1}, {0, 0, 0}};
  for (const Curve curve : {Curve::lebesgue, Curve::hilbert}) {
    const std::vector<uint32_t> order = curve_order(points, curve);
    EXPECT_EQ(order, (std::vector<uint32_t>{1, 3, 0, 2}));
  }
  const std::vector<Vec3f> same(3, Vec3f{2, 2, 2});
  for (const Curve curve : {Curve::none, Curve::lebesgue, Curve::hilbert})
    EXPECT_EQ(curve_order(same, curve), (std::vector<uint32_t>{0, 1, 2}));
  EXPECT_TRUE(curve_order({}, Curve::hilbert).empty());
}

}  // namespace
}  // namespace deltalux::samples
