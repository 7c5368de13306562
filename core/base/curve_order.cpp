// SPDX-License-Identifier: Apache-2.0
// Sorts points by their cells' 63-bit positions on the curve. Hilbert after Skilling, "Programming
// the Hilbert curve" (AIP Conference Proceedings 707, 2004): transforms the cell's coordinates into
// the transpose of the position.
#include "base/curve_order.h"

#include <algorithm>
#include <compare>
#include <numeric>

namespace deltalux {
namespace {

constexpr int kBits = 21;  // per axis
using Cell = std::array<uint32_t, 3>;

/// Interleaves the bits of all axes, the highest bit first, the first axis first.
uint64_t interleave(const Cell& cell) {
  uint64_t key = 0;
  for (int bit = kBits - 1; bit >= 0; --bit)
    for (const uint32_t axis : cell) key = key << 1 | (axis >> bit & 1);
  return key;
}

Cell hilbert_transpose(Cell x) {
  constexpr uint32_t kTop = 1u << (kBits - 1);
  for (uint32_t q = kTop; q > 1; q >>= 1)
    for (uint32_t& axis : x) {
      const uint32_t below = q - 1;
      if (axis & q) {
        x[0] ^= below;
      } else {
        const uint32_t differ = (x[0] ^ axis) & below;
        x[0] ^= differ, axis ^= differ;
      }
    }
  x[1] ^= x[0], x[2] ^= x[1];  // Gray code
  uint32_t flip = 0;
  for (uint32_t q = kTop; q > 1; q >>= 1)
    if (x[2] & q) flip ^= q - 1;
  for (uint32_t& axis : x) axis ^= flip;
  return x;
}

}  // namespace

std::vector<uint32_t> curve_order(std::span<const Vec3f> points, Curve curve,
                                  const Progress* progress, std::span<const uint64_t> ties) {
  std::vector<uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  if (curve == Curve::none) return order;
  Box box;
  for (const Vec3f p : points) box.grow(p);
  const Vec3d low(box.low), extent = Vec3d(box.high) - low;
  const double side = std::max({extent.x, extent.y, extent.z});
  constexpr double kCells = 1u << kBits;
  struct Place {
    uint64_t key, tie;
    uint32_t point;
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> places(points.size());
  for (uint32_t i = 0; i < points.size(); ++i) {
    if (progress && i % 65536 == 0) progress->check();
    Cell cell{};
    for (int axis = 0; axis < 3; ++axis)
      if (side > 0)
        cell[size_t(axis)] =
            uint32_t(std::min((double(points[i][axis]) - low[axis]) / side * kCells, kCells - 1));
    places[i] = {interleave(curve == Curve::hilbert ? hilbert_transpose(cell) : cell),
                 ties.empty() ? 0 : ties[i], i};
  }
  std::sort(places.begin(), places.end());
  for (size_t i = 0; i < places.size(); ++i) order[i] = places[i].point;
  return order;
}

}  // namespace deltalux
