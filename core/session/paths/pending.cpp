// SPDX-License-Identifier: Apache-2.0
// Counting sort into groups. Within a group, paths keep the order in which the search found them,
// which is that of memory.
#include "session/paths/pending.h"

#include <algorithm>
#include <array>

#include "base/assertion.h"

namespace deltalux::session {

namespace {
constexpr uint32_t kGroups = 64;
}

EditMarks::EditMarks(PathLayer& paths) : paths_(paths), older_(paths.pending.size()) {
  if (older_) place_.resize(paths.cut.size());
  for (size_t i = 0; i < older_; ++i) {
    paths_.pending[i].hit_known = false;
    place_[paths_.held.slot_of(paths_.pending[i].path)] = uint32_t(i);
  }
}

void EditMarks::mark(const PendingPath& path) {
  DELTALUX_ASSERT(path.bounce < kNotCut);
  DELTALUX_ASSERT(paths_.store.bounces()[path.bounce].at(path.slot).path == path.path);
  const uint32_t first_slot = paths_.held.slot_of(path.path);
  DELTALUX_ASSERT(first_slot < paths_.cut.size());
  uint16_t& cut = paths_.cut[first_slot];
  if (cut <= path.bounce) return;
  // An edit visits a path's bounces in ascending order, so an existing mark is that of an older
  // edit.
  if (cut == kNotCut) {
    paths_.pending.push_back(path);
  } else {
    DELTALUX_ASSERT(paths_.pending[place_[first_slot]].path == path.path);
    paths_.pending[place_[first_slot]] = path;
  }
  cut = path.bounce;
}

void EditMarks::mark_all(const trace::Light& light) {
  paths_.held.each_of(light, [&](uint64_t i) {
    const auto path = uint32_t(light.first_path + i);
    mark({path, paths_.held.slot_of(path), 0, false, {}});
  });
}

void EditMarks::add_lights(size_t first) {
  const std::vector<trace::Light>& lights = paths_.world.lights;
  for (size_t l = first; l < lights.size(); ++l) paths_.held.add(lights[l]);
  for (const uint32_t slot : paths_.add_unused())
    mark({paths_.held.path_of(slot), slot, 0, false, {}});
}

void EditMarks::order() {
  std::vector<uint8_t> group(paths_.pending.size() - older_);
  std::array<size_t, kGroups + 1> start{};
  for (size_t i = 0; i < group.size(); ++i) {
    const uint32_t path = paths_.pending[older_ + i].path;
    const trace::Light& light = paths_.world.lights[paths_.world.light_of(path)];
    group[i] = uint8_t((path - light.first_path) * kGroups / light.path_count);
    ++start[group[i] + 1u];
  }
  for (uint32_t g = 0; g < kGroups; ++g) start[g + 1] += start[g];
  std::vector<PendingPath> sorted(group.size());
  for (size_t i = 0; i < group.size(); ++i) sorted[start[group[i]]++] = paths_.pending[older_ + i];
  std::copy(sorted.begin(), sorted.end(), paths_.pending.begin() + long(older_));
}

bool agree(const PathLayer& paths) {
  const std::vector<uint16_t>& cut = paths.cut;
  const auto uncut = size_t(std::count(cut.begin(), cut.end(), kNotCut));
  return cut.size() - uncut == paths.pending.size() &&
         std::all_of(paths.pending.begin(), paths.pending.end(), [&](const PendingPath& path) {
           const std::optional<uint32_t> slot = paths.held.find(path.path);
           return slot && cut[*slot] == path.bounce;
         });
}

}  // namespace deltalux::session
