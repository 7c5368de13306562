// SPDX-License-Identifier: Apache-2.0
// Traverses a ray map with many queries together, so that every node is read once, and splits
// leaves. What happens in a node depends only on its queries, so subtrees can be processed by
// different threads.
#include <algorithm>
#include <cmath>
#include <string>

#include "estimate/ray_map/clip.h"
#include "estimate/ray_map/ray_map.h"
#include "estimate/ray_map/split.h"

namespace deltalux::estimate {
namespace {

constexpr int kSharedLevels = 7;   // nodes of these levels are distributed over threads one by one
constexpr uint32_t kDeepest = 62;  // levels
constexpr size_t kWholeProgress = size_t(1) << 40;

}  // namespace

/// One call of RayMap::visit().
class RayMapDescent {
 public:
  struct Task {
    RayNode* node;
    Box cell;
    std::vector<uint32_t> queries;
    int64_t budget;  ///< bytes
  };

  RayMapDescent(RayMap& map, std::span<const Box> boxes, const RayMap::Query& query,
                const RayMap::Visit& visit, Progress* progress)
      : map_(map), query_(query), visit_(visit), progress_(progress) {
    boxes_.reserve(boxes.size());
    for (const Box& box : boxes) boxes_.push_back(box.padded(map.margin()));
  }

  RayMapStats run(const Workers& workers) {
    constexpr float kOut = RayMap::kOutside;
    std::vector<uint32_t> all(boxes_.size());
    for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
    const int64_t limit = int64_t(map_.options_.memory_limit);
    const int64_t budget = limit ? limit - int64_t(map_.bytes()) : int64_t(1) << 62;
    std::vector<Task> level, next;
    level.push_back(
        {&map_.root_, {{-kOut, -kOut, -kOut}, {kOut, kOut, kOut}}, std::move(all), budget});
    RayMapStats stats;
    if (progress_) progress_->begin("ray map", kWholeProgress);
    for (uint32_t depth = 0; !level.empty(); ++depth) {
      std::vector<RayMapStats> parts(level.size());
      std::vector<std::vector<Task>> children(level.size());
      workers.for_blocks(level.size(), 1, [&](size_t i, size_t) {
        Walker walker(*this, parts[i]);
        if (depth < kSharedLevels)
          children[i] = walker.step(level[i], depth);
        else
          walker.walk(level[i], depth);
      });
      next.clear();
      for (size_t i = 0; i < level.size(); ++i) {
        stats += parts[i];
        for (Task& task : children[i]) next.push_back(std::move(task));
      }
      level.swap(next);
    }
    return stats;
  }

 private:
  /// Processes one subtree in one thread.
  class Walker {
   public:
    Walker(RayMapDescent& descent, RayMapStats& stats)
        : d_(descent), map_(descent.map_), stats_(stats) {}

    /// Depth first. The budget that one child leaves goes to the other one.
    void walk(Task& task, uint32_t depth) {
      std::vector<Task> children = step(task, depth);
      task.queries = std::vector<uint32_t>();
      int64_t left_over = 0;
      for (Task& child : children) {
        child.budget += left_over;
        walk(child, depth + 1);
        left_over = child.budget;
        if (!map_.options_.keep) *child.node = {};
      }
      task.budget = left_over + (children.empty() ? task.budget : 0);
    }

    /// Visits a node: tests the segments of a leaf, or returns the children of an inner node.
    std::vector<Task> step(Task& task, uint32_t depth) {
      RayNode& node = *task.node;
      if (d_.progress_) d_.progress_->check();
      stats_.box_tests += task.queries.size();
      if (node.follower != d_.query_.follower && d_.query_.follower) {
        node.follower = d_.query_.follower;
        node.settled = 0;
      }
      if (node.child) {
        part_queries(task, node.axis, node.plane);
        sink(node, task.cell);
      } else if (depth >= kDeepest || !open(node, task)) {
        test(node, task);
        advance(depth);
        return {};
      }
      return children(node, task, depth);
    }

   private:
    void advance(uint32_t depth) const {
      if (d_.progress_) d_.progress_->advance(kWholeProgress >> depth);
    }

    void part_queries(const Task& task, int axis, float plane) {
      queries_[0].clear(), queries_[1].clear();
      for (const uint32_t q : task.queries) {
        if (d_.boxes_[q].low[axis] < plane) queries_[0].push_back(q);
        if (d_.boxes_[q].high[axis] > plane) queries_[1].push_back(q);
      }
    }

    void clear_halves(size_t most) {
      for (HalfList& half : half_) half.clear(most);
    }
    void classify(const Box& cell, int axis, float plane, std::span<const uint32_t> ids) {
      CellSplit(cell, axis, plane, map_.margin(), map_.rule_, map_.radius_, map_.options_.ends_only)
          .classify(map_.records_.data(), ids, half_[0], half_[1]);
      stats_.tests.node_tests += ids.size();
    }

    void sink(RayNode& node, const Box& cell) {
      if (node.late.empty()) return;
      clear_halves(node.late.size());
      classify(cell, node.axis, node.plane, node.late);
      for (int i = 0; i < 2; ++i) node.child[i].add(half_[i].ids());
      node.late.clear();
    }

    /// Splits a leaf if that pays.
    bool open(RayNode& node, Task& task) {
      const size_t count = node.count(), settled = node.settled;
      // A follower only tests new segments.
      if (count <= map_.options_.leaf_size || settled > count / 2) return false;
      node.visits = uint32_t(std::min<uint64_t>(node.visits + task.queries.size(), 1u << 30));
      if (node.visits <= node.patience) return false;
      const SplitChoice choice = choose_split(d_.boxes_, task.queries, task.cell, map_.bounds_,
                                              node.visits, d_.query_.split_cost);
      if (!choice.worth) return false;
      part_queries(task, choice.axis, choice.plane);
      clear_halves(count);
      const auto halve = [&](std::span<const uint32_t> ids) {
        classify(task.cell, choice.axis, choice.plane, ids);
      };
      node.for_range(0, settled, halve);
      const size_t settled_half[2] = {half_[0].count, half_[1].count};
      node.for_range(settled, halve);
      double left = 0;  // tests
      for (int i = 0; i < 2; ++i) left += double(queries_[i].size()) * double(half_[i].count);
      if (left > 0.9 * double(task.queries.size()) * double(count)) {
        node.patience = 2 * node.visits;
        return false;
      }
      const auto more =
          int64_t(2 * sizeof(RayNode)) +
          int64_t(sizeof(uint32_t)) * (int64_t(half_[0].count + half_[1].count) - int64_t(count));
      if (more > task.budget) {
        ++stats_.refused;
        return false;
      }
      task.budget -= more;
      ++stats_.splits;
      node.axis = uint8_t(choice.axis), node.plane = choice.plane;
      node.child = std::make_unique<RayNode[]>(2);
      for (int i = 0; i < 2; ++i) {
        RayNode& child = node.child[i];
        if (map_.options_.keep || !queries_[i].empty())
          child.ids.assign(half_[i].ids().begin(), half_[i].ids().end());
        child.settled = uint32_t(settled_half[i]), child.follower = node.follower;
      }
      node.drop_lists();
      node.settled = 0;
      return true;
    }

    /// The children that have queries, with their shares of the budget.
    std::vector<Task> children(RayNode& node, const Task& task, uint32_t depth) {
      const double all = double(queries_[0].size() + queries_[1].size());
      std::vector<Task> tasks;
      for (int i = 0; i < 2; ++i) {
        if (queries_[i].empty()) {
          advance(depth + 1);
          continue;
        }
        Box cell = task.cell;
        (i ? cell.low : cell.high)[node.axis] = node.plane;
        const double share = double(queries_[i].size()) / all;
        tasks.push_back({&node.child[i], cell, queries_[i],
                         task.budget > 0 ? int64_t(share * double(task.budget)) : 0});
      }
      return tasks;
    }

    void test(RayNode& node, const Task& task) {
      if (d_.visit_)
        node.for_range(d_.query_.follower ? node.settled : 0, [&](std::span<const uint32_t> ids) {
          stats_.tests += d_.visit_({task.cell, ids, task.queries});
        });
      if (d_.query_.follower) node.settled = uint32_t(node.count());
      if (!map_.options_.keep) node.drop_lists();
    }

    RayMapDescent& d_;
    RayMap& map_;
    RayMapStats& stats_;
    HalfList half_[2];
    std::vector<uint32_t> queries_[2];
  };

  RayMap& map_;
  std::vector<Box> boxes_;
  const RayMap::Query query_;
  const RayMap::Visit& visit_;
  Progress* const progress_;
};

RayMapStats RayMap::visit(std::span<const Box> boxes, const Query& query, const Visit& visit,
                          const Workers& workers, Progress* progress) {
  float reach = 0;
  for (const Box& box : boxes)
    for (int axis = 0; axis < 3; ++axis) {
      const float far = std::max(std::fabs(box.low[axis]), std::fabs(box.high[axis]));
      if (!(far <= kFarthest))
        throw OptionError("ray map: found a query at " + std::to_string(far) +
                          " m, expected finite numbers up to 1e15 m");
      reach = std::max(reach, far);
    }
  widen(reach, query.radius);
  if (boxes.empty()) return {};
  return RayMapDescent(*this, boxes, query, visit, progress).run(workers);
}

}  // namespace deltalux::estimate
