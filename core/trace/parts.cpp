// SPDX-License-Identifier: Apache-2.0
// Halves the largest part again and again, and keeps those of the divisions that are worth it.
#include "trace/parts.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace deltalux::trace {
namespace {

constexpr float kWorth = 0.01f;  // what one more part costs, in units of the whole box's surface
constexpr size_t kLeaves = 32;   // parts that are tried
constexpr size_t kBins = 32;
constexpr float kSmallest = 1e-3f;  // smaller parts, in these units, are not halved

struct Triangle {
  Box box;
  Vec3f centre;
};

/// Triangles whose centres lie between two planes.
struct Bin {
  Box box{};
  size_t count = 0;
  void add(const Box& own) { box.grow(own), ++count; }
  void add(const Bin& own) { box.grow(own.box), count += own.count; }
  float cost() const { return box.half_area() * float(count); }
};

/// The tree of parts and their halves.
class Tree {
 public:
  explicit Tree(std::span<const Triangle> triangles) : triangles_(triangles) {
    std::vector<uint32_t> all(triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    add(std::move(all));
    whole_ = nodes_[0].surface;
    std::vector<size_t> leaves{0};
    while (leaves.size() < kLeaves) {
      const auto largest = std::max_element(
          leaves.begin(), leaves.end(), [&](size_t a, size_t b) { return reach(a) < reach(b); });
      if (!(reach(*largest) > kSmallest * whole_)) break;
      if (!halve(*largest)) continue;
      *largest = nodes_[*largest].half;
      leaves.push_back(*largest + 1);
    }
    // Halves come after what they are halves of.
    for (size_t node = nodes_.size(); node-- > 0;) weigh(nodes_[node]);
  }
  /// Calls part(triangles) for each part of the best division.
  template <class Take>
  void each_part(const Take& part, size_t node = 0, size_t count = Parts::kMost) const {
    const Node& own = nodes_[node];
    if (!own.half || own.least[count] == own.surface) return part(own.own);
    for (size_t k = 1; k < count; ++k) {
      const Node &a = nodes_[own.half], &b = nodes_[own.half + 1];
      if (a.least[k] + b.least[count - k] + kWorth * whole_ != own.least[count]) continue;
      each_part(part, own.half, k);
      return each_part(part, own.half + 1, count - k);
    }
    each_part(part, node, count - 1);
  }

 private:
  struct Node {
    std::vector<uint32_t> own;
    float surface;
    bool whole = false;                           ///< cannot be halved
    size_t half = 0;                              ///< of two, the first node; 0: it is not halved
    std::array<float, Parts::kMost + 1> least{};  ///< cost of its best division in at most so many
  };
  void add(std::vector<uint32_t> own) {
    Box box;
    for (const uint32_t i : own) box.grow(triangles_[i].box);
    nodes_.push_back({std::move(own), box.half_area()});
  }
  /// The surface of what may be halved.
  float reach(size_t node) const { return nodes_[node].whole ? 0.0f : nodes_[node].surface; }
  /// Adds the best halves by planes through an axis, as between the bins of Wald 2007 (IEEE RT); of
  /// those with the least surface alone, most would be single triangles. False if all centres are
  /// in one place.
  bool halve(size_t node) {
    const std::vector<uint32_t> own = nodes_[node].own;
    Box centres;
    for (const uint32_t i : own) centres.grow(triangles_[i].centre);
    int best_axis = 0;
    size_t best = 0;
    float least = std::numeric_limits<float>::infinity();
    const auto bin_of = [&](uint32_t i, int axis) {
      const float from = centres.low[axis], length = centres.high[axis] - from;
      return std::min(kBins - 1, size_t(kBins * ((triangles_[i].centre[axis] - from) / length)));
    };
    for (int axis = 0; axis < 3; ++axis) {
      if (!(centres.low[axis] < centres.high[axis])) continue;
      std::array<Bin, kBins> bins;
      for (const uint32_t i : own) bins[bin_of(i, axis)].add(triangles_[i].box);
      std::array<float, kBins> behind;
      Bin sum;
      for (size_t i = kBins; i-- > 0;) sum.add(bins[i]), behind[i] = sum.cost();
      sum = {};
      for (size_t i = 1; i < kBins; ++i) {
        sum.add(bins[i - 1]);
        if (const float cost = sum.cost() + behind[i]; cost < least)
          least = cost, best_axis = axis, best = i;
      }
    }
    if (!best) return nodes_[node].whole = true, false;
    std::vector<uint32_t> below, above;
    for (const uint32_t i : own) (bin_of(i, best_axis) < best ? below : above).push_back(i);
    nodes_[node].half = nodes_.size();
    add(std::move(below)), add(std::move(above));
    return true;
  }
  void weigh(Node& node) const {
    node.least.fill(node.surface);
    if (!node.half) return;
    const Node &a = nodes_[node.half], &b = nodes_[node.half + 1];
    for (size_t count = 2; count < node.least.size(); ++count) {
      node.least[count] = node.least[count - 1];
      for (size_t k = 1; k < count; ++k)
        node.least[count] =
            std::min(node.least[count], a.least[k] + b.least[count - k] + kWorth * whole_);
    }
  }

  std::span<const Triangle> triangles_;
  float whole_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace

Parts::Parts(std::span<const Vec3f> vertices, std::span<const std::array<uint32_t, 3>> triangles)
    : part_(triangles.size()) {
  if (triangles.empty()) return;
  std::vector<Triangle> all;
  for (const auto& corners : triangles) {
    Box box;
    for (const uint32_t corner : corners) box.grow(vertices[corner]);
    all.push_back({box, box.centre()});
  }
  Tree(all).each_part([&](std::span<const uint32_t> own) {
    for (const uint32_t triangle : own) part_[triangle] = uint8_t(count_);
    ++count_;
  });
}

std::vector<Box> Parts::boxes(std::span<const Vec3f> vertices,
                              std::span<const std::array<uint32_t, 3>> triangles) const {
  std::vector<Box> out(count_);
  for (size_t i = 0; i < triangles.size(); ++i)
    for (const uint32_t corner : triangles[i]) out[part_[i]].grow(vertices[corner]);
  return out;
}

}  // namespace deltalux::trace
