// SPDX-License-Identifier: Apache-2.0
// Merges points by cells: with a hash table, or by sorting where the order matters.
#include "samples/places.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/error.h"

namespace deltalux::samples {
namespace {

double largest(Vec3d p) { return std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)}); }

/// A hash table that finds the first entry with the same key.
class Table {
 public:
  explicit Table(size_t most)
      : slots_(std::bit_ceil(2 * most + 1), kEmpty), shift_(std::countl_zero(slots_.size()) + 1) {}

  /// The number of the first entry with this key, which is `number` if there is none before.
  uint32_t first(uint64_t key, uint32_t number, std::span<const uint64_t> keys) {
    for (size_t at = key * kGolden >> shift_;; at = (at + 1) & (slots_.size() - 1)) {
      if (slots_[at] == kEmpty) slots_[at] = number;
      if (keys[slots_[at]] == key) return slots_[at];
    }
  }

 private:
  static constexpr uint32_t kEmpty = 0xffffffffu;
  static constexpr uint64_t kGolden = 0x9e3779b97f4a7c15u;
  std::vector<uint32_t> slots_;
  int shift_;
};

}  // namespace

std::vector<int64_t> same_places(std::span<const Vec3d> points, double rounding) {
  if (points.empty()) return {};
  if (points.size() >= 0xffffffffu) throw Error("mesh: more than 4e9 points");
  Vec3d low = points[0], high = points[0];
  for (const Vec3d& p : points) low = min(low, p), high = max(high, p);
  const Vec3d middle = 0.5 * (low + high);
  double most = 0;
  for (const Vec3d& p : points) most = std::max(most, largest(p - middle));
  const double cell = std::max(most * rounding, std::numeric_limits<double>::min());
  const auto step = [&](double x) {
    return uint64_t(int64_t(std::nearbyint(x / cell)) + (int64_t(1) << 20));
  };
  std::vector<uint64_t> keys(points.size());
  Table table(points.size());
  std::vector<int64_t> place(points.size());
  for (uint32_t i = 0; i < points.size(); ++i) {
    const Vec3d p = points[i] - middle;
    keys[i] = step(p.x) << 42 | step(p.y) << 21 | step(p.z);
    place[i] = table.first(keys[i], i, keys);
  }
  return place;
}

std::pair<std::vector<int64_t>, std::vector<int64_t>> welded_points(std::span<const Vec3d> points,
                                                                    std::span<const int64_t> first,
                                                                    double rounding) {
  struct Cell {
    uint64_t x, yz;
    uint32_t point;
    bool same(const Cell& other) const { return x == other.x && yz == other.yz; }
    bool operator<(const Cell& other) const {
      return x != other.x ? x < other.x : yz != other.yz ? yz < other.yz : point < other.point;
    }
  };
  if (points.size() >= 0xffffffffu) throw Error("mesh: more than 4e9 points");
  std::pair<std::vector<int64_t>, std::vector<int64_t>> out;
  auto& [representative, position] = out;
  position.resize(points.size());
  std::vector<Cell> cells;
  for (size_t body = 0; body + 1 < first.size(); ++body) {
    const std::span own =
        points.subspan(size_t(first[body]), size_t(first[body + 1] - first[body]));
    double extent = 0;
    for (const Vec3d& p : own) extent = std::max(extent, largest(p));
    const double cell = std::max(rounding * extent, std::numeric_limits<double>::min());
    const auto step = [&](double x) {
      return uint64_t(int64_t(std::nearbyint(x / cell)) + (int64_t(1) << 31));
    };
    cells.clear();
    for (size_t i = 0; i < own.size(); ++i)
      cells.push_back({step(own[i].x), step(own[i].y) << 32 | step(own[i].z),
                       uint32_t(size_t(first[body]) + i)});
    std::sort(cells.begin(), cells.end());
    for (size_t i = 0; i < cells.size(); ++i) {
      if (i == 0 || !cells[i].same(cells[i - 1])) representative.push_back(cells[i].point);
      position[cells[i].point] = int64_t(representative.size()) - 1;
    }
  }
  return out;
}

}  // namespace deltalux::samples
