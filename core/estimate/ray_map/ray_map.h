// SPDX-License-Identifier: Apache-2.0
// Ray map (Havran, Bittner, Herzog, Seidel 2005): a kd-tree over segments that is refined lazily
// where queries go. Segments can be added and removed at any time.
#pragma once
#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/vec.h"
#include "estimate/estimator.h"

namespace deltalux::estimate {

/// One segment in half a cache line. A removed segment has a negative `length` and a zero
/// `direction`, so that it crosses nothing.
struct alignas(32) RayRecord {
  Vec3f origin, direction;
  float length, extended;
  bool alive() const { return length >= 0; }
};

/// Nodes own their children. The segments of a leaf are `ids`, then `late`: those added after it
/// was created. They are separate since adding a few segments would otherwise copy every list. An
/// inner node has only `late`, which move to the children when a query passes. The follower
/// `follower` has already seen the first `settled` segments.
struct RayNode {
  std::unique_ptr<RayNode[]> child;
  std::vector<uint32_t> ids, late;
  uint32_t settled = 0, follower = 0;
  uint32_t visits = 0;    ///< queries that tested all segments of this leaf
  uint32_t patience = 0;  ///< visits before a split is tried (again)
  float plane = 0;
  uint8_t axis = 0;

  /// Frees the memory of the lists; assigning {} would not.
  void drop_lists() { ids = std::vector<uint32_t>(), late = std::vector<uint32_t>(); }
  size_t count() const { return ids.size() + late.size(); }
  void add(std::span<const uint32_t> more) {
    late.insert(late.end(), more.begin(), more.end());
    if (child || late.size() <= 16 + ids.size() / 2) return;
    ids.reserve(count());
    ids.insert(ids.end(), late.begin(), late.end());
    late = std::vector<uint32_t>();
  }
  /// Calls f(part of ids), f(part of late) for the segments at positions `begin` to `end`.
  template <class F>
  void for_range(size_t begin, size_t end, F&& f) const {
    const size_t middle = ids.size();
    if (begin < std::min(end, middle))
      f(std::span(ids).subspan(begin, std::min(end, middle) - begin));
    if (const size_t from = std::max(begin, middle); from < end)
      f(std::span(late).subspan(from - middle, end - from));
  }
  template <class F>
  void for_range(size_t begin, F&& f) const {
    for_range(begin, count(), f);
  }
};

struct RayMapOptions {
  uint32_t leaf_size = 32;  ///< leaves of up to this many segments are never split
  /// bytes of the whole map, 0 = none; when it is reached, leaves are not split
  size_t memory_limit = 0;
  /// False: for one query; the tree is discarded during the traversal.
  bool keep = true;
  bool ends_only = false;  ///< the tree holds only the first hits, not the segments' whole lengths
};

struct RayMapStats {
  Stats tests;
  /// `refused`: splits that the memory limit did not allow.
  uint64_t splits = 0, refused = 0;
  uint64_t box_tests = 0;  ///< queries that reached a node
  RayMapStats& operator+=(const RayMapStats& o) {
    tests += o.tests, splits += o.splits, refused += o.refused, box_tests += o.box_tests;
    return *this;
  }
};

/// A lazily built kd-tree. Cells are half-open boxes [low, high) that partition space; the root's
/// sides are at kOutside.
class RayMap {
 public:
  static constexpr float kOutside = 1e30f;

  RayMap(segments::SegmentEnd rule, const RayMapOptions& options);

  /// Adds segments and returns their ids: from 0 in a new map; ids of removed segments are reused.
  std::vector<uint32_t> push(const segments::SegmentSpan& segments);
  /// Removes segments. Throws OptionError for an id that no segment has.
  void remove(std::span<const uint32_t> ids);

  /// What `visit` gets for a leaf. `queries`: indices of the boxes that meet its cell. `ids`: the
  /// segments there, all of them in one call or two, or those that the follower has not seen.
  struct Leaf {
    const Box& cell;
    std::span<const uint32_t> ids;
    std::span<const uint32_t> queries;
  };
  /// Tests a leaf and returns statistics. Called from several threads.
  using Visit = std::function<Stats(const Leaf&)>;

  struct Query {
    /// of the largest disc to be tested; infinity: consider segments to their full extended length
    float radius = 0;
    /// Cost of sorting a segment into the halves of a leaf, in tests by `visit`.
    float split_cost = 0.5f;
    /// Identifies the caller, and marks what it has seen; 0 = nobody.
    uint32_t follower = 0;
  };

  /// Traverses the tree with all boxes together, splits leaves where that pays, and calls `visit`
  /// (unless empty) for each leaf that boxes reach. Every segment whose counting part meets a box
  /// is in `ids` of the leaf that contains any of their common points, up to rounding errors of
  /// `margin()`. Neither the tree nor the statistics depend on the number of workers.
  RayMapStats visit(std::span<const Box> boxes, const Query& query, const Visit& visit,
                    const Workers& workers, Progress* progress = nullptr);

  /// Segments for which box tests are unreliable (too far away, too long directions); every query
  /// has to test them.
  RayNode& odd() { return odd_; }
  const RayNode& odd() const { return odd_; }
  const RayNode& root() const { return root_; }
  const RayRecord& record(uint32_t id) const { return records_[id]; }
  std::span<const RayRecord> records() const { return records_; }
  /// Ids below this number can be assigned without reallocating arrays indexed by id.
  size_t room() const { return records_.capacity(); }
  segments::SegmentEnd rule() const { return rule_; }
  /// Upper bound of all coordinates of origins and queries.
  float reach() const { return reach_; }
  float margin() const { return reach_ * 0x1p-18f; }
  size_t live() const { return records_.size() - dead_ - free_.size(); }
  /// Marks all segments as not seen by any follower.
  void unsettle();
  /// Increases when the tree restarts; followers have then seen nothing.
  uint32_t generation() const { return generation_; }
  size_t bytes() const;

 private:
  friend class RayMapDescent;
  bool is_usual(const RayRecord& r) const;
  void widen(float reach, float radius);
  void sweep();

  const segments::SegmentEnd rule_;
  const RayMapOptions options_;
  std::vector<RayRecord> records_;
  std::vector<uint32_t> free_;
  size_t dead_ = 0;  ///< removed segments that nodes may still list
  RayNode root_, odd_;
  Box bounds_;  ///< bounds of the segments, for the cost of splits
  float reach_ = 0, radius_ = 0;
  uint32_t generation_ = 1;
};

}  // namespace deltalux::estimate
