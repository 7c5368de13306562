// SPDX-License-Identifier: Apache-2.0
// Ray map (Havran, Bittner, Herzog, Seidel 2005): a kd-tree over segments that grows where queries
// look, and that segments enter and leave at any time.
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

/// One segment, half a cache line. Of a removed one `length` is negative and `direction` zero, so
/// that it crosses nothing.
struct alignas(32) RayRecord {
  Vec3f origin, direction;
  float length, extended;
  bool alive() const { return length >= 0; }
};

/// Nodes own their children. A leaf's segments are `ids`, then `late`: those that came after it was
/// made, apart because adding a few to every list would copy all of them. An inner node has `late`
/// only, which sink when a query passes. The first `settled` are known to the follower `follower`.
struct RayNode {
  std::unique_ptr<RayNode[]> child;
  std::vector<uint32_t> ids, late;
  uint32_t settled = 0, follower = 0;
  uint32_t visits = 0;    ///< queries that tested all segments here
  uint32_t patience = 0;  ///< visits before a split is tried (again)
  float plane = 0;
  uint8_t axis = 0;

  /// Gives the memory of the lists back, as assigning {} would not.
  void drop_lists() { ids = std::vector<uint32_t>(), late = std::vector<uint32_t>(); }
  size_t count() const { return ids.size() + late.size(); }
  void add(std::span<const uint32_t> more) {
    late.insert(late.end(), more.begin(), more.end());
    if (child || late.size() <= 16 + ids.size() / 2) return;
    ids.reserve(count());
    ids.insert(ids.end(), late.begin(), late.end());
    late = std::vector<uint32_t>();
  }
  /// Calls f(part of ids), f(part of late) with the segments from place `begin` to `end`.
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
  uint32_t leaf_size = 32;  ///< leaves of up to so many segments are never split
  size_t memory_limit = 0;  ///< bytes of the whole map, 0 = none; then leaves stay big
  bool keep = true;         ///< false: for one query; the tree is forgotten behind it
  bool ends_only = false;   ///< the tree holds the first hits alone, not the ways there
};

struct RayMapStats {
  Stats tests;
  uint64_t splits = 0, refused = 0;  ///< refused: splits that the memory limit forbade
  uint64_t box_tests = 0;            ///< queries that came to a node
  RayMapStats& operator+=(const RayMapStats& o) {
    tests += o.tests, splits += o.splits, refused += o.refused, box_tests += o.box_tests;
    return *this;
  }
};

/// Half-open cells [low, high) part space; the root's sides are kOutside.
class RayMap {
 public:
  static constexpr float kOutside = 1e30f;

  RayMap(segments::SegmentEnd rule, const RayMapOptions& options);

  /// Ids of the new segments: those of a new map count from 0; of removed ones are used again.
  std::vector<uint32_t> push(const segments::SegmentSpan& segments);
  /// Throws OptionError for an id that no segment has.
  void remove(std::span<const uint32_t> ids);

  /// What a leaf is asked: `queries` are indices of the boxes that meet its cell, `ids` segments
  /// there: all of them in one call or two, or those that the follower has not seen.
  struct Leaf {
    const Box& cell;
    std::span<const uint32_t> ids;
    std::span<const uint32_t> queries;
  };
  /// Tests a leaf and returns the hits. Called from several threads.
  using Visit = std::function<Stats(const Leaf&)>;

  struct Query {
    float radius = 0;         ///< of the largest disc in question; infinity: as far as segments go
    float split_cost = 0.5f;  ///< of sorting a segment into halves of a leaf, in tests of `visit`
    uint32_t follower = 0;    ///< who asks, and marks what it has seen; 0 = nobody
  };

  /// Leads boxes down the tree together, opening leaves where that pays, and calls `visit` for each
  /// leaf with boxes (unless empty). Every segment whose countable part meets a box is in `ids` of
  /// the leaf that holds any point they share, up to rounding of `margin()`. Neither tree nor stats
  /// depend on the number of workers.
  RayMapStats visit(std::span<const Box> boxes, const Query& query, const Visit& visit,
                    const Workers& workers, Progress* progress = nullptr);

  /// Segments that boxes cannot hold (too far, too fast); every query has to test them.
  RayNode& odd() { return odd_; }
  const RayNode& odd() const { return odd_; }
  const RayNode& root() const { return root_; }
  const RayRecord& record(uint32_t id) const { return records_[id]; }
  std::span<const RayRecord> records() const { return records_; }
  /// Ids may grow to here before arrays by id have to move.
  size_t room() const { return records_.capacity(); }
  segments::SegmentEnd rule() const { return rule_; }
  /// No coordinate of an origin or a query is greater.
  float reach() const { return reach_; }
  float margin() const { return reach_ * 0x1p-18f; }
  size_t live() const { return records_.size() - dead_ - free_.size(); }
  /// Lets every follower have seen nothing.
  void unsettle();
  /// Rises when the tree starts anew; followers then have seen nothing.
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
  size_t dead_ = 0;  ///< removed, perhaps still listed in nodes
  RayNode root_, odd_;
  Box bounds_;  ///< of the flights, for the cost of splits
  float reach_ = 0, radius_ = 0;
  uint32_t generation_ = 1;
};

}  // namespace deltalux::estimate
