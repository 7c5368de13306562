// SPDX-License-Identifier: Apache-2.0
// The closed list of edits: whatever changes a session's scene is one of these.
#pragma once
#include <cstdint>
#include <variant>

#include "base/transform.h"
#include "scene/scene.h"

namespace deltalux::scene {

struct Move {
  uint32_t object;
  Pose pose;
};
/// Takes a movable away (present = false) or puts it back where it was.
struct SetPresent {
  uint32_t object;
  bool present;
};
struct Insert {
  Object object;
};
struct Dim {
  uint32_t group;
  double factor;  ///< absolute: 1 = as loaded
};
struct SetReflectance {
  uint32_t material;
  Vec3f reflectance;
};

using Edit = std::variant<Move, SetPresent, Insert, Dim, SetReflectance>;

}  // namespace deltalux::scene
