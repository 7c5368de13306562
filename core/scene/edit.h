// SPDX-License-Identifier: Apache-2.0
// The complete list of edits of a session's scene.
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
/// Removes a movable (present = false), or puts it back where it was.
struct SetPresent {
  uint32_t object;
  bool present;
};
/// Adds a new movable object.
struct Insert {
  Object object;
};
/// Dims a light group.
struct Dim {
  uint32_t group;
  double factor;  ///< absolute; 1 = as loaded
};
struct SetReflectance {
  uint32_t material;
  Vec3f reflectance;
};

using Edit = std::variant<Move, SetPresent, Insert, Dim, SetReflectance>;

}  // namespace deltalux::scene
