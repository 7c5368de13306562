// SPDX-License-Identifier: Apache-2.0
// Whether what a session file holds can be the state of a session. All functions throw FormatError.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "scene/scene.h"
#include "segments/segment_store.h"
#include "session/path_update.h"

namespace deltalux::session::snapshot {

[[noreturn]] void refuse(const std::string& what);
[[noreturn]] void refuse_entry(const char* name, size_t entry, double found, double low,
                               double high);

template <class T>
void check_range(const char* name, const std::vector<T>& values, double low, double high) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!(double(values[i]) >= low && double(values[i]) <= high))
      refuse_entry(name, i, double(values[i]), low, high);
}

/// A quantum of energy or irradiance is no finer than any light asks for, and no coarser than the
/// `chosen` one by more than edits explain: else sums of it could overflow.
void check_quantum(const char* name, double found, double chosen);

/// Static objects stand where the scene has them, movable ones within the world and not distorted.
/// The poses are finite.
void check_poses(const std::vector<scene::Object>& original, const scene::Scene& scene);

/// Radii are those that were `given`; where that is NaN, positive and no larger than the world, or
/// NaN before the bake.
void check_radii(std::span<const float> radius, std::span<const float> given, const Box& world,
                 bool baked);

/// What discs count lies between nothing and somewhat more than their circles.
void check_areas(std::span<const float> area, std::span<const float> radius,
                 std::span<const float> openness);

/// Sums of quanta are not negative and no larger than `segments` can make them.
void check_sums(std::span<const int64_t> sums, size_t segments);

/// Bounce 0 has a slot per path, later ones no more.
void check_level_sizes(std::span<const uint64_t> sizes, uint64_t paths, uint32_t max_bounces);

/// Numbers of one segment in use: finite, about the world, and names of things that are there.
class SegmentCheck {
 public:
  SegmentCheck(const scene::Scene& scene, uint64_t paths, size_t discs);
  void operator()(const segments::Segment& segment, float reach, const segments::HitSlots& hits,
                  uint32_t bounce) const;

 private:
  Box around_;
  float longest_;
  uint64_t paths_;
  uint32_t primitives_;
  size_t discs_;
};

/// Every path is one chain: at bounce 0 the slot is the path, and each later segment in use has
/// exactly one predecessor, of its own path.
void check_chains(const segments::SegmentStore& store);

/// Each path with a mark in `cut` waits once, at its own segment of that bounce; others do not.
void check_pending(const std::vector<PendingPath>& pending, const std::vector<uint8_t>& cut,
                   const segments::SegmentStore& store);

}  // namespace deltalux::session::snapshot
