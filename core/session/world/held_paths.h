// SPDX-License-Identifier: Apache-2.0
// Which of the paths a session holds, and where: the numbers of the paths in its range, and their
// slots at bounce 0.
#pragma once
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "base/assertion.h"
#include "trace/lights.h"

namespace deltalux::session {

/// A part of all paths, first <= last <= Options::paths. Of every batch of every light it takes the
/// same share: of `count` paths those from index count * first / paths up to count * last / paths,
/// rounded down. Ranges that follow each other therefore share no path and leave none out, also of
/// lights that edits add; where a batch has at least as many paths as there are equal ranges, each
/// range has some of it.
struct PathRange {
  uint64_t first = 0, last = 0;
};

/// Numbers are those of all paths, so that a path is the same in every range; slots are
/// consecutive, in the order of path numbers. In a session that holds all paths the two are equal.
class HeldPaths {
 public:
  HeldPaths() = default;
  /// Holds nothing until add(). `paths`: number of all paths, see PathRange.
  HeldPaths(PathRange range, uint64_t paths, uint32_t batches)
      : range_(range), paths_(paths), batches_(batches) {}

  /// Holds the paths of `light` that are in the range. Lights come in ascending order of paths.
  void add(const trace::Light& light);
  /// Number of paths held.
  uint64_t size() const { return size_; }
  /// The slot of a path, which must be held.
  uint32_t slot_of(uint32_t path) const {
    DELTALUX_ASSERT(find(path));
    return slot_if_held(path);
  }
  /// The slot of a path, or nullopt if it is not held.
  std::optional<uint32_t> find(uint32_t path) const {
    if (!size_ || path < runs_.front().first_path) return std::nullopt;
    const uint32_t slot = slot_if_held(path);
    return slot < size_ && path_of(slot) == path ? std::optional(slot) : std::nullopt;
  }
  uint32_t path_of(uint32_t slot) const {
    DELTALUX_ASSERT(slot < size_);
    const Run& run = last_run([&](const Run& r) { return r.first_slot <= slot; });
    return uint32_t(run.first_path + (slot - run.first_slot));
  }
  /// Indices within the light of the held paths of one batch: from the first up to the second.
  std::pair<uint64_t, uint64_t> of_batch(const trace::Light& light, uint32_t batch) const;
  /// Calls visit(index within the light) for every held path of the light.
  template <class Visit>
  void each_of(const trace::Light& light, const Visit& visit) const {
    for (uint32_t batch = 0; batch < batches_; ++batch)
      for (auto [i, end] = of_batch(light, batch); i < end; ++i) visit(i);
  }

 private:
  /// Paths with consecutive numbers, up to the next run's.
  struct Run {
    uint64_t first_path, first_slot;
  };
  /// The slot of `path`, if it is held.
  uint32_t slot_if_held(uint32_t path) const {
    const Run& run = last_run([&](const Run& r) { return r.first_path <= path; });
    return uint32_t(run.first_slot + (path - run.first_path));
  }
  /// The last run for which before() holds; it holds for the first one.
  template <class Before>
  const Run& last_run(const Before& before) const {
    size_t low = 0, high = runs_.size();
    while (high - low > 1) {
      const size_t middle = (low + high) / 2;
      (before(runs_[middle]) ? low : high) = middle;
    }
    return runs_[low];
  }

  PathRange range_;
  uint64_t paths_ = 1;
  uint32_t batches_ = 1;
  uint64_t size_ = 0;
  std::vector<Run> runs_;  // ascending
};

}  // namespace deltalux::session
