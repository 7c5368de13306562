// SPDX-License-Identifier: Apache-2.0
// Counting sort into groups. Within a group, paths keep the order in which the search found them,
// which is that of memory.
#include "session/pending.h"

#include <algorithm>
#include <array>

#include "base/assertion.h"

namespace deltalux::session {

namespace {
constexpr uint32_t kGroups = 64;
}

EditMarks::EditMarks(State& state, std::vector<PendingPath>& waiting)
    : state_(state), waiting_(waiting), older_(waiting.size()) {
  if (older_) place_.resize(state.cut.size());
  for (size_t i = 0; i < older_; ++i) {
    waiting_[i].hit_known = false;
    place_[state_.held.slot_of(waiting_[i].path)] = uint32_t(i);
  }
}

void EditMarks::mark(const PendingPath& path) {
  DELTALUX_ASSERT(path.bounce < kNotCut);
  DELTALUX_ASSERT(state_.store.bounces()[path.bounce].at(path.slot).path == path.path);
  const uint32_t first_slot = state_.held.slot_of(path.path);
  DELTALUX_ASSERT(first_slot < state_.cut.size());
  uint16_t& cut = state_.cut[first_slot];
  if (cut <= path.bounce) return;
  // An edit visits a path's bounces in ascending order, so an existing mark is that of an older
  // edit.
  if (cut == kNotCut) {
    waiting_.push_back(path);
  } else {
    DELTALUX_ASSERT(waiting_[place_[first_slot]].path == path.path);
    waiting_[place_[first_slot]] = path;
  }
  cut = path.bounce;
}

void EditMarks::order() {
  std::vector<uint8_t> group(waiting_.size() - older_);
  std::array<size_t, kGroups + 1> start{};
  for (size_t i = 0; i < group.size(); ++i) {
    const uint32_t path = waiting_[older_ + i].path;
    const trace::Light& light = state_.lights[state_.light_of(path)];
    group[i] = uint8_t((path - light.first_path) * kGroups / light.path_count);
    ++start[group[i] + 1u];
  }
  for (uint32_t g = 0; g < kGroups; ++g) start[g + 1] += start[g];
  std::vector<PendingPath> sorted(group.size());
  for (size_t i = 0; i < group.size(); ++i) sorted[start[group[i]]++] = waiting_[older_ + i];
  std::copy(sorted.begin(), sorted.end(), waiting_.begin() + long(older_));
}

bool agree(std::span<const uint16_t> cut, const HeldPaths& held,
           std::span<const PendingPath> waiting) {
  const auto uncut = size_t(std::count(cut.begin(), cut.end(), kNotCut));
  return cut.size() - uncut == waiting.size() &&
         std::all_of(waiting.begin(), waiting.end(), [&](const PendingPath& path) {
           const std::optional<uint32_t> slot = held.find(path.path);
           return slot && cut[*slot] == path.bounce;
         });
}

}  // namespace deltalux::session
