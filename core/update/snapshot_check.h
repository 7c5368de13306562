// SPDX-License-Identifier: Apache-2.0
// Whether what a session file holds can be the state of a session. All functions throw FormatError.
#pragma once
#include <string>
#include <vector>

#include "scene/scene.h"
#include "segments/segment_store.h"
#include "update/path_update.h"

namespace deltalux::update::snapshot {

[[noreturn]] void refuse(const std::string& what);
[[noreturn]] void refuse_entry(const char* name, size_t entry, double found, double low,
                               double high);

template <class T>
void check_range(const char* name, const std::vector<T>& values, double low, double high) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!(double(values[i]) >= low && double(values[i]) <= high))
      refuse_entry(name, i, double(values[i]), low, high);
}

/// Static objects stand where the scene has them, movable ones within the world and not distorted.
void check_poses(const std::vector<scene::Object>& original, const scene::Scene& scene);

/// Numbers are finite, and every path is one chain: at bounce 0 the slot is the path, and each
/// later segment in use has exactly one predecessor, of its own path.
void check_segments(const segments::SegmentStore& store, const scene::Scene& scene, uint64_t paths);

/// Each path with a mark in `cut` waits once, at its own segment of that bounce; others do not.
void check_pending(const std::vector<PendingPath>& pending, const std::vector<uint8_t>& cut,
                   const segments::SegmentStore& store);

}  // namespace deltalux::update::snapshot
