// SPDX-License-Identifier: Apache-2.0
// Ray queries over the static scene and the movable objects of a scene.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/transform.h"
#include "base/vec.h"
#include "scene/scene.h"
#include "trace/embree_scene.h"
#include "trace/ray.h"

namespace deltalux::trace {

/// A piece of a line, from its nearer end to its farther one.
struct Stretch {
  float begin, end;
};

/// Closest hit = the least (t, rank) over the static scene (rank 0) and each present movable
/// object in its own acceleration structure (rank 1 + object), every one of them queried over the
/// whole ray. So a hit is a pure function of the ray and of each object's pose: what one object
/// does never changes the bits that another returns.
class RayCaster {
 public:
  RayCaster(const scene::Scene& scene, Progress& progress);
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// One object as it was: put_back() undoes an update_object() without anything that can fail.
  class Saved;
  Saved save_object(uint32_t object) const;
  void put_back(Saved&& saved) noexcept;

  /// Commits `object` (movable, possibly new) in its present pose; on failure nothing has changed.
  /// Not while queries run.
  void update_object(const scene::Scene& scene, uint32_t object);
  /// Forgets objects from number `count` on.
  void drop_objects(size_t count) noexcept;

  Hit closest(Vec3f origin, Vec3f direction, float from = 0.0f,
              float to = std::numeric_limits<float>::infinity()) const;
  Hit closest_static(Vec3f origin, Vec3f direction, float from = 0.0f,
                     float to = std::numeric_limits<float>::infinity()) const;
  Hit closest_object(uint32_t object, Vec3f origin, Vec3f direction, float from = 0.0f,
                     float to = std::numeric_limits<float>::infinity()) const;
  /// The winner among `best` (found by other means) and `object`, by the rule above.
  Hit closer(const Hit& best, uint32_t object, Vec3f origin, Vec3f direction, float from = 0.0f,
             float to = std::numeric_limits<float>::infinity()) const;

  bool occluded_static(Vec3f origin, Vec3f direction, float to) const;
  bool occluded_object(uint32_t object, Vec3f origin, Vec3f direction, float to) const;
  /// By anything.
  bool occluded(Vec3f origin, Vec3f direction, float to) const;
  /// The rays in `wanted` that the static scene (an object) blocks; three times faster than single
  /// rays. The answers belong to the fan as a whole: rays that begin on a triangle, lie in its
  /// plane or pass through its edge (3e-5 of them, no others) are answered otherwise in other
  /// company. So let `wanted` follow from the present state alone, never from its history.
  RayBits occluded_static(const RayFan& fan, const RayBits& wanted) const;
  RayBits occluded_object(uint32_t object, const RayFan& fan, const RayBits& wanted) const;

  /// Appends what of origin + t * direction, 0 <= t <= to, lies inside `object` (unit direction).
  /// Nothing where the object is not closed, see scene::Object.
  void add_inside(uint32_t object, Vec3f origin, Vec3f direction, float to,
                  std::vector<Stretch>& out) const;

  /// World bounds of a movable object, `margin()` larger than its triangles; empty when removed.
  const Box& object_bounds(uint32_t object) const { return movables_[object].bounds; }
  std::span<const uint32_t> present() const { return present_; }
  /// Bounds are this much larger than what they hold: more than rays that begin anywhere in the
  /// scene's world may miss them by.
  float margin() const { return margin_; }
  /// Embree's version, the instruction set in use and this library's build.
  std::string description() const;

 private:
  struct Movable {
    EmbreeScene scene;  ///< in world space; empty while it is removed
    EmbreeScene solid;  ///< in its own space, of closed objects: inside and outside
    Box bounds;
    Pose to_local;
    uint32_t first_primitive = 0;
  };
  bool reaches(const Movable& movable, Vec3f origin, Vec3f direction, float to) const;
  void list_present() noexcept;

  EmbreeDevice device_;
  EmbreeScene static_;
  std::vector<Movable> movables_;  // per object; static ones stay empty
  std::vector<uint32_t> present_;  // movable objects with triangles, ascending
  float margin_ = 0;
};

class RayCaster::Saved {
  friend class RayCaster;
  uint32_t object_ = 0;
  Movable movable_;
};

}  // namespace deltalux::trace
