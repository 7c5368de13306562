// SPDX-License-Identifier: Apache-2.0
// Builds the disc hierarchy: first a binary tree by the binned surface-area heuristic (Wald 2007),
// then the cheapest grouping of its nodes into nodes of eight children (Aila et al. 2013,
// appendix).
#include "estimate/disc_index/tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace deltalux::estimate {
namespace {

constexpr int kBins = 16;
// discs per task; fixed, so that the tree does not depend on the number of threads
constexpr uint32_t kTaskSize = 1 << 15;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Item {
  Vec3f low;
  uint32_t disc;
  Vec3f high;
  float centre(int axis) const { return low[axis] + high[axis]; }  // twice the centre
};

struct BinaryNode {
  Box box;
  uint32_t begin = 0, end = 0;     // items
  uint32_t left = 0, right = 0;    // 0 = leaf
  float cost[kLanes + 1] = {};     // [k]: of the subtree when it fills at most k lanes of a parent
  uint8_t taken[kLanes + 1] = {};  // [k]: lanes it then fills (1: a node of its own)
  uint8_t left_lanes[kLanes + 1] = {};  // [k]: how many of these go to the left child, when > 1
  bool leaf() const { return left == 0; }
};

/// A leaf with three discs costs as much as a full one.
float leaf_count(uint32_t discs) { return float((discs + kLanes - 1) / kLanes); }

struct Split {
  int axis = -1;
  int last_left = 0;  // index of the last bin on the left side
};

/// Bins of item centres along each axis.
struct Binning {
  Vec3f origin, scale;

  explicit Binning(const Box& centres) : origin(centres.low) {
    const Vec3f extent = centres.extent();
    for (int axis = 0; axis < 3; ++axis)
      scale[axis] = extent[axis] > 1e-30f ? 0.999f * float(kBins) / extent[axis] : 0;
  }
  int bin(const Item& item, int axis) const {
    return std::min(kBins - 1, int((item.centre(axis) - origin[axis]) * scale[axis]));
  }
};

class Builder {
 public:
  Builder(std::vector<Item>& items, Progress* progress) : items_(items), progress_(progress) {}

  /// Builds the subtree of items [begin, end); its root comes first. Ranges of up to `task_size`
  /// items stay leaves.
  std::vector<BinaryNode> build(uint32_t begin, uint32_t end, uint32_t task_size) {
    nodes_.clear();
    nodes_.push_back({});
    nodes_[0].begin = begin, nodes_[0].end = end;
    for (size_t k = 0; k < nodes_.size(); ++k) split(k, task_size);
    return std::move(nodes_);
  }

 private:
  void split(size_t k, uint32_t task_size) {
    const uint32_t begin = nodes_[k].begin, end = nodes_[k].end;
    if (progress_ && end - begin >= 4096) progress_->check();
    Box box, centres;
    for (uint32_t i = begin; i < end; ++i) {
      box.grow(Box{items_[i].low, items_[i].high});
      centres.grow(items_[i].low + items_[i].high);
    }
    nodes_[k].box = box;
    if (end - begin <= task_size) return;
    const uint32_t middle = partition(begin, end, Binning(centres));
    nodes_[k].left = uint32_t(nodes_.size()), nodes_[k].right = nodes_[k].left + 1;
    nodes_.resize(nodes_.size() + 2);
    nodes_[nodes_[k].left].begin = begin, nodes_[nodes_[k].left].end = middle;
    nodes_[nodes_[k].right].begin = middle, nodes_[nodes_[k].right].end = end;
  }

  uint32_t partition(uint32_t begin, uint32_t end, const Binning& binning) {
    const Split split = best_split(begin, end, binning);
    if (split.axis < 0) return begin + (end - begin) / 2;  // all centres coincide
    const auto middle = std::partition(
        items_.begin() + begin, items_.begin() + end,
        [&](const Item& item) { return binning.bin(item, split.axis) <= split.last_left; });
    return uint32_t(middle - items_.begin());
  }

  Split best_split(uint32_t begin, uint32_t end, const Binning& binning) const {
    Box box[3][kBins];
    uint32_t count[3][kBins] = {};
    for (uint32_t i = begin; i < end; ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const int b = binning.bin(items_[i], axis);
        box[axis][b].grow(Box{items_[i].low, items_[i].high});
        ++count[axis][b];
      }
    Split best;
    float best_cost = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      float right_cost[kBins];
      Box side;
      uint32_t discs = 0;
      for (int b = kBins - 1; b > 0; --b) {
        side.grow(box[axis][b]), discs += count[axis][b];
        right_cost[b] = discs ? side.half_area() * leaf_count(discs) : kInfinity;
      }
      side = Box(), discs = 0;
      for (int b = 0; b + 1 < kBins; ++b) {
        side.grow(box[axis][b]), discs += count[axis][b];
        const float cost = side.half_area() * leaf_count(discs) + right_cost[b + 1];
        if (discs && cost < best_cost) best_cost = cost, best = {axis, b};
      }
    }
    return best;
  }

  std::vector<Item>& items_;
  Progress* progress_;
  std::vector<BinaryNode> nodes_;
};

/// Finds the cheapest way to put two subtrees into at most k lanes of one node.
void share_lanes(BinaryNode& node, const BinaryNode& left, const BinaryNode& right, int k) {
  for (int i = 1; i < k; ++i) {
    const float cost = left.cost[i] + right.cost[k - i];
    if (cost < node.cost[k])
      node.cost[k] = cost, node.taken[k] = uint8_t(k), node.left_lanes[k] = uint8_t(i);
  }
}

/// Dynamic programming: cost = sum of the areas of eight-wide nodes (the area of leaves is given).
void weigh(std::vector<BinaryNode>& nodes) {
  for (size_t n = nodes.size(); n-- > 0;) {  // children follow their parents
    BinaryNode& node = nodes[n];
    if (node.leaf()) continue;
    std::fill_n(node.cost, kLanes + 1, kInfinity);
    for (int k = 2; k <= kLanes; ++k) share_lanes(node, nodes[node.left], nodes[node.right], k);
    node.cost[1] = node.box.half_area() + node.cost[kLanes];
    node.taken[1] = 1;
    for (int k = 2; k < kLanes; ++k)
      if (node.cost[k - 1] <= node.cost[k]) {
        node.cost[k] = node.cost[k - 1];
        node.taken[k] = node.taken[k - 1], node.left_lanes[k] = node.left_lanes[k - 1];
      }
  }
}

/// Converts the binary tree into the tree of eight-wide nodes.
class Collapse {
 public:
  Collapse(const samples::DiscSet& discs, const std::vector<Item>& items,
           const std::vector<BinaryNode>& binary, DiscTree& tree)
      : discs_(discs), items_(items), binary_(binary), tree_(tree) {}

  void run() {
    struct Task {
      uint32_t binary, node;
      int depth;
    };
    std::vector<Task> tasks{{0, 0, 1}};
    tree_.nodes.resize(1);
    while (!tasks.empty()) {
      const Task task = tasks.back();
      tasks.pop_back();
      tree_.depth = std::max(tree_.depth, task.depth);
      children_.clear();
      const BinaryNode& root = binary_[task.binary];
      if (root.leaf()) {
        children_.push_back(task.binary);
      } else {
        gather(root.left, root.left_lanes[kLanes]);
        gather(root.right, kLanes - root.left_lanes[kLanes]);
      }
      const auto first_leaf = std::stable_partition(children_.begin(), children_.end(),
                                                    [&](uint32_t c) { return !binary_[c].leaf(); });
      const uint32_t inner = uint32_t(first_leaf - children_.begin());
      const uint32_t base = uint32_t(tree_.nodes.size());
      emit(tree_.nodes[task.node], inner, base);
      tree_.nodes.resize(base + inner);
      for (uint32_t i = 0; i < inner; ++i)
        tasks.push_back({children_[i], base + i, task.depth + 1});
    }
  }

 private:
  void gather(uint32_t subtree, int lanes) {
    const BinaryNode& node = binary_[subtree];
    const int taken = node.leaf() ? 1 : node.taken[lanes];
    if (taken == 1) {
      children_.push_back(subtree);
      return;
    }
    const int left = node.left_lanes[lanes];
    gather(node.left, left);
    gather(node.right, taken - left);
  }

  void emit(DiscNode& node, uint32_t inner, uint32_t inner_base) {
    node.inner = inner;
    node.inner_base = inner_base;
    node.leaf_base = uint32_t(tree_.leaves.size()) - inner;
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const Box box = lane < children_.size() ? binary_[children_[lane]].box : Box();
      for (int axis = 0; axis < 3; ++axis) {
        node.bound[2 * axis][lane] = box.low[axis];
        node.bound[2 * axis + 1][lane] = box.high[axis];
      }
    }
    for (size_t lane = inner; lane < children_.size(); ++lane) emit_leaf(binary_[children_[lane]]);
  }

  void emit_leaf(const BinaryNode& node) {
    DiscLeaf leaf{};
    for (uint32_t i = node.begin, lane = 0; i < node.end; ++i, ++lane) {
      const uint32_t k = items_[i].disc;
      const Vec3f c = discs_.centre[k], n = discs_.normal[k];
      leaf.cx[lane] = c.x, leaf.cy[lane] = c.y, leaf.cz[lane] = c.z;
      leaf.nx[lane] = n.x, leaf.ny[lane] = n.y, leaf.nz[lane] = n.z;
      leaf.radius[lane] = discs_.radius[k];
      leaf.disc[lane] = discs_.outline[k] == samples::kWholeDisc ? k : k | DiscLeaf::kClipped;
    }
    tree_.leaves.push_back(leaf);
  }

  const samples::DiscSet& discs_;
  const std::vector<Item>& items_;
  const std::vector<BinaryNode>& binary_;
  DiscTree& tree_;
  std::vector<uint32_t> children_;
};

/// The smallest box of the flat disc. The traversal accounts for rounding in crossing.h.
Item bound_disc(const samples::DiscSet& discs, uint32_t k) {
  const Vec3f c = discs.centre[k];
  const Vec3d n(discs.normal[k]);
  const double n2 = dot(n, n), r = discs.radius[k];
  Item item;
  item.disc = k;
  for (int axis = 0; axis < 3; ++axis) {
    // The length of a normal cancels in the crossing test, unless it is so small that products
    // underflow.
    const double flat = n2 > 1e-20 ? std::max(0.0, 1.0 - n[axis] * n[axis] / n2) : 1.0;
    item.low[axis] = float(c[axis] - r * std::sqrt(flat));
    item.high[axis] = float(c[axis] + r * std::sqrt(flat));
  }
  const Vec3f far = max(-item.low, item.high);
  if (!(r >= 0 && std::isfinite(n2) && far.x < kFarthest && far.y < kFarthest && far.z < kFarthest))
    throw OptionError("disc " + std::to_string(k) +
                      ": found a centre, normal or radius that is not finite, a radius below 0, or "
                      "a place beyond 1e15 metres; expected finite numbers: check the samples");
  return item;
}

}  // namespace

DiscTree build_disc_tree(const samples::DiscSet& discs, const Workers& workers,
                         Progress* progress) {
  DiscTree tree;
  if (discs.size() == 0) return tree;
  const uint32_t count = uint32_t(discs.size());
  std::vector<Item> items(count);
  workers.for_blocks(count, kTaskSize, [&](size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k) items[k] = bound_disc(discs, uint32_t(k));
  });

  std::vector<BinaryNode> binary = Builder(items, progress).build(0, count, kTaskSize);
  std::vector<uint32_t> tasks;
  for (uint32_t k = 0; k < binary.size(); ++k)
    if (binary[k].leaf()) tasks.push_back(k);
  std::vector<std::vector<BinaryNode>> subtrees(tasks.size());
  workers.for_blocks(tasks.size(), 1, [&](size_t begin, size_t) {
    const BinaryNode& task = binary[tasks[begin]];
    subtrees[begin] = Builder(items, progress).build(task.begin, task.end, kLanes);
  });
  for (size_t t = 0; t < tasks.size(); ++t) {
    const uint32_t offset =
        uint32_t(binary.size()) - 1;  // the subtree's root takes the task's place
    for (BinaryNode& node : subtrees[t])
      if (!node.leaf()) node.left += offset, node.right += offset;
    binary[tasks[t]] = subtrees[t][0];
    binary.insert(binary.end(), subtrees[t].begin() + 1, subtrees[t].end());
    subtrees[t] = {};
  }
  if (progress) progress->check();

  weigh(binary);
  Collapse(discs, items, binary, tree).run();
  if (tree.leaves.size() > size_t(1) << kNodeBits)
    throw OptionError("disc index: " + std::to_string(count) + " discs are more than fit (about " +
                      std::to_string(6 << kNodeBits) + "): use fewer samples");
  const Vec3f far = max(-binary[0].box.low, binary[0].box.high);
  // Not 0: in the tiniest scenes, squared distances underflow, but the margin must not.
  tree.reach = std::max({far.x, far.y, far.z, 1e-15f});
  tree.max_radius = *std::max_element(discs.radius.begin(), discs.radius.end());
  return tree;
}

}  // namespace deltalux::estimate
