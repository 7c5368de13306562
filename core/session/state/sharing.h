// SPDX-License-Identifier: Apache-2.0
// What a session that shares paths or rays with others remembers between their messages.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "gather/hits/gather_hits.h"
#include "session/shared/awaited.h"
#include "session/world/held_paths.h"

namespace deltalux::session {

/// The sums that Exchange::path_changes() returned last.
struct SentSums {
  std::vector<int64_t> discs, cells;
  uint32_t groups = 1;  ///< that `cells` is laid out for
  uint64_t edits = 0;
  void set_groups(uint32_t count);
  size_t bytes() const { return (discs.capacity() + cells.capacity()) * sizeof(int64_t); }
};

/// A gather between Exchange::begin_gather() and the last take_hits(), in a session without paths.
struct BegunGather {
  gather::GatherHits hits{{}, 0};  ///< of no samples before take_numbers()
  Awaited awaited;
};

struct State;

struct Sharing {
  /// In a session without paths: the ranges of other sessions whose sums, of the present state, are
  /// in these sums; and the edits in effect when those of all paths were, nullopt: never yet.
  std::vector<PathRange> added;
  std::optional<uint64_t> added_since;
  std::unique_ptr<SentSums> sent;
  std::unique_ptr<BegunGather> begun;
  std::unique_ptr<State> choices;  ///< see choice_state(), until the numbers of rays are chosen
  std::unique_ptr<Awaited> awaited_direct;  ///< null: direct light is there

  /// How many paths of other sessions have their sums here.
  uint64_t added_paths() const {
    uint64_t paths = 0;
    for (const PathRange& range : added) paths += range.last - range.first;
    return paths;
  }
  size_t bytes() const { return (begun ? begun->hits.bytes() : 0) + (sent ? sent->bytes() : 0); }
};

}  // namespace deltalux::session
