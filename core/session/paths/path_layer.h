// SPDX-License-Identifier: Apache-2.0
// The layer of paths: the stored segments of those that a session holds, and which of them wait to
// be traced again.
#pragma once
#include <vector>

#include "base/archive.h"
#include "base/progress.h"
#include "segments/segment_store.h"
#include "session/world/lanes.h"
#include "session/world/world.h"

namespace deltalux::session {

/// A path to be traced again from `bounce`, which its entry of PathLayer::cut equals; `slot` holds
/// its segment of that bounce.
struct PendingPath {
  uint32_t path = 0;
  uint32_t slot = 0;
  uint16_t bounce = 0;
  /// Whether `hit` is the segment's new first hit, found by the search; valid until the next edit.
  bool hit_known = false;
  trace::Hit hit;
};

/// A hash of stored segments as a set: `count` and hashes of sets without common segments add up,
/// modulo 2^64.
struct SegmentsHash {
  uint64_t count = 0, a = 0, b = 0;
};

struct PathLayer {
  explicit PathLayer(const World& w) : world(w) {}

  const World& world;
  HeldPaths held;
  segments::SegmentStore store;
  // By slot of bounce 0: the bounce from which its path waits to be traced again, or kNotCut.
  std::vector<uint16_t> cut;
  std::vector<PendingPath> pending;  // those that wait, in the order of replacement

  /// Holds the paths of the present lights, without segments.
  void prepare();
  /// The same, all of them waiting to be traced.
  void wait();
  /// Gives held paths that have no first segment yet one that is not in use. Returns the slots.
  std::vector<uint32_t> add_unused();
  /// The share of the paths that wait.
  double pending_share() const {
    return cut.empty() ? 0.0 : double(pending.size()) / double(cut.size());
  }
  size_t bytes() const {
    return store.bytes() + cut.capacity() + pending.capacity() * sizeof(PendingPath);
  }
  /// Expected memory.
  double bytes_per_segment() const;
  /// Of the segments held.
  SegmentsHash hash() const;
  /// Number of slots by bounce.
  std::vector<uint64_t> level_sizes() const;
  void save(ArchiveView& archive) const;
  /// Restores what save() wrote. `cells`, `discs`: how many there are, to which segments refer.
  void restore(ArchiveSource& archive, uint32_t cells, size_t discs, Progress& progress);

 private:
  void restore_pending(ArchiveSource& archive);
};

}  // namespace deltalux::session
