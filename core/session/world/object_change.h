// SPDX-License-Identifier: Apache-2.0
// What an edit changed of an object, and which samples that moves.
#pragma once
#include <span>
#include <vector>

#include "session/world/world.h"

namespace deltalux::session {

/// The change of one object: its bounds before and after the edit. An empty box means that the
/// object is absent.
struct ObjectChange {
  uint32_t object = scene::kNone;
  Box before, after;
  std::vector<Box> parts_before{}, parts_after{};  ///< tighter, see RayCaster::part_bounds()
};

/// All boxes of `changes` that are not empty.
std::vector<Box> boxes_of(std::span<const ObjectChange> changes);
/// Indices of the samples that lie on changed objects.
std::vector<uint32_t> moved_samples(const World& world, std::span<const ObjectChange> changes);

}  // namespace deltalux::session
