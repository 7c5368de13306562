// SPDX-License-Identifier: Apache-2.0
// Sorts edges by their lower ends (counting sort), then each group by the higher ends.
#include "samples/mesh_edges.h"

#include <algorithm>
#include <numeric>

#include "base/error.h"

namespace deltalux::samples {
namespace {

/// Items with a key of two numbers, sorted by key, then by their own numbers.
class Sorted {
 public:
  struct Item {
    uint32_t high, number;
    bool operator<(const Item& other) const {
      return high != other.high ? high < other.high : number < other.number;
    }
  };

  /// `low_of` and `high_of` give the keys of items below `count`; keys are below `limit`.
  template <class Low, class High>
  Sorted(size_t count, size_t limit, const Low& low_of, const High& high_of) : items_(count) {
    if (count > 0xffffffffu || limit > 0xffffffffu) throw Error("mesh: more than 4e9 corners");
    std::vector<uint32_t> place(limit + 1);
    for (size_t i = 0; i < count; ++i) ++place[low_of(i) + 1];
    for (size_t i = 0; i < limit; ++i) place[i + 1] += place[i];
    for (size_t i = 0; i < count; ++i)
      items_[place[low_of(i)]++] = {uint32_t(high_of(i)), uint32_t(i)};
    uint32_t begin = 0;
    for (size_t low = 0; low < limit; ++low) {
      const uint32_t end = place[low];
      std::sort(items_.begin() + begin, items_.begin() + end);
      for (uint32_t i = begin; i < end; ++i)
        if (i == begin || items_[i].high != items_[i - 1].high) begins_.push_back(i);
      begin = end;
    }
    begins_.push_back(uint32_t(count));
  }

  /// A run is the items with one key, in the order of their numbers; runs are in the order of keys.
  size_t runs() const { return begins_.size() - 1; }
  std::span<const Item> run(size_t i) const {
    return std::span(items_).subspan(begins_[i], begins_[i + 1] - begins_[i]);
  }

 private:
  std::vector<Item> items_;
  std::vector<uint32_t> begins_;
};

struct Ends {
  int64_t from, to;
};

Ends ends_of(std::span<const Triangle> triangles, size_t edge) {
  const Triangle& t = triangles[edge / 3];
  return {t[edge % 3], t[(edge + 1) % 3]};
}

Sorted by_ends(std::span<const Triangle> triangles, size_t points) {
  return Sorted(
      3 * triangles.size(), points,
      [&](size_t edge) {
        const Ends ends = ends_of(triangles, edge);
        return size_t(std::min(ends.from, ends.to));
      },
      [&](size_t edge) {
        const Ends ends = ends_of(triangles, edge);
        return size_t(std::max(ends.from, ends.to));
      });
}

}  // namespace

std::pair<std::vector<int64_t>, std::vector<int64_t>> shared_edges(
    std::span<const Triangle> triangles, size_t points) {
  const Sorted edges = by_ends(triangles, points);
  std::pair<std::vector<int64_t>, std::vector<int64_t>> pairs;
  std::vector<uint32_t> longer(edges.runs());
  std::iota(longer.begin(), longer.end(), 0u);
  // Usually two triangles share an edge. If more do, compare every pair of them.
  for (size_t offset = 1; !longer.empty(); ++offset) {
    std::erase_if(longer, [&](uint32_t run) { return edges.run(run).size() <= offset; });
    for (uint32_t run : longer) {
      const std::span<const Sorted::Item> same = edges.run(run);
      for (size_t i = 0; i + offset < same.size(); ++i) {
        const uint32_t one = same[i].number, two = same[i + offset].number;
        if (ends_of(triangles, one).from != ends_of(triangles, two).to) continue;
        pairs.first.push_back(one);
        pairs.second.push_back(two);
      }
    }
  }
  return pairs;
}

std::vector<uint8_t> junctions(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                               double shortest) {
  std::vector<uint8_t> found(3 * triangles.size());
  const Sorted edges = by_ends(triangles, points.size());
  std::vector<int64_t> apexes;
  for (size_t i = 0; i < edges.runs(); ++i) {
    const std::span<const Sorted::Item> same = edges.run(i);
    if (same.size() < 3) continue;
    const Ends ends = ends_of(triangles, same[0].number);
    if (!(length(points[size_t(ends.to)] - points[size_t(ends.from)]) >= shortest)) continue;
    apexes.clear();
    for (const Sorted::Item& edge : same)
      apexes.push_back(triangles[edge.number / 3][(edge.number + 2) % 3]);
    std::sort(apexes.begin(), apexes.end());
    if (std::unique(apexes.begin(), apexes.end()) - apexes.begin() < 3) continue;
    for (const Sorted::Item& edge : same) found[edge.number] = 1;
  }
  return found;
}

std::vector<uint8_t> repeated_triangles(std::span<const Triangle> triangles, size_t points) {
  const auto sorted = [&](size_t t) {
    Triangle corners = triangles[t];
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  const Sorted by_low(
      triangles.size(), points, [&](size_t t) { return size_t(sorted(t)[0]); },
      [&](size_t t) { return size_t(sorted(t)[1]); });
  std::vector<uint8_t> again(triangles.size());
  std::vector<std::pair<int64_t, uint32_t>> rest;
  for (size_t i = 0; i < by_low.runs(); ++i) {
    rest.clear();
    for (const Sorted::Item& item : by_low.run(i))
      rest.emplace_back(sorted(item.number)[2], item.number);
    std::sort(rest.begin(), rest.end());
    for (size_t k = 1; k < rest.size(); ++k)
      again[rest[k].second] = rest[k].first == rest[k - 1].first;
  }
  return again;
}

}  // namespace deltalux::samples
