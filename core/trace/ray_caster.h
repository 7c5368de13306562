// SPDX-License-Identifier: Apache-2.0
// Ray queries over the static geometry and the movable objects of a scene.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/transform.h"
#include "base/vec.h"
#include "scene/scene.h"
#include "trace/embree_scene.h"
#include "trace/parts.h"
#include "trace/ray.h"

namespace deltalux::trace {

/// An interval of a ray's parameter.
struct Stretch {
  float begin, end;
};

/// The closest hit is the smallest (t - lead, rank) over the static geometry (rank 0) and all
/// present movable objects (rank 1 + object). Each has its own acceleration structure, which is
/// queried over the whole ray. So a hit is a pure function of the ray and of the objects' poses,
/// and what happens to one object never changes the bits of another object's hit. The lead decides,
/// instead of rounding, which of two surfaces in one plane is hit: that of a movable rather than a
/// static one.
class RayCaster {
 public:
  /// If surfaces of the scene have holes or let light pass, the scene must outlive the caster.
  RayCaster(const scene::Scene& scene, Progress& progress);
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// The saved state of one object: put_back() undoes an update_object() and cannot fail.
  class Saved;
  Saved save_object(uint32_t object) const;
  void put_back(Saved&& saved) noexcept;

  /// Builds the structure of `object` (movable, possibly new) in its present pose; if this fails,
  /// nothing has changed. Must not run concurrently with queries.
  void update_object(const scene::Scene& scene, uint32_t object);
  /// Removes the objects from index `count` on.
  void drop_objects(size_t count) noexcept;

  /// The closest hit among all present geometry; the next two: in static geometry, and on one
  /// object.
  Hit closest(Vec3f origin, Vec3f direction, float from = 0.0f,
              float to = std::numeric_limits<float>::infinity()) const;
  Hit closest_static(Vec3f origin, Vec3f direction, float from = 0.0f,
                     float to = std::numeric_limits<float>::infinity()) const;
  Hit closest_object(uint32_t object, Vec3f origin, Vec3f direction, float from = 0.0f,
                     float to = std::numeric_limits<float>::infinity()) const;
  /// The closer one of `best` and the hit on `object`, by the rule above.
  Hit closer(const Hit& best, uint32_t object, Vec3f origin, Vec3f direction, float from = 0.0f,
             float to = std::numeric_limits<float>::infinity()) const;

  /// A new structure of one movable in its own space.
  EmbreeScene in_own_space(const scene::Scene& scene, uint32_t object) const;

  /// The lead of a body (kNone: the static geometry), measured at right angles to the surface, in
  /// units of position_slack(). Paths leave surfaces from higher above.
  static float lead(uint32_t body) {
    return body == scene::kNone ? 0.0f : 0.25f + 0.125f * float(body % 4);
  }

  /// Whether static geometry, one object, or anything blocks all light of the ray before `to`.
  bool occluded_static(Vec3f origin, Vec3f direction, float to) const;
  bool occluded_object(uint32_t object, Vec3f origin, Vec3f direction, float to) const;
  bool occluded(Vec3f origin, Vec3f direction, float to) const;
  /// Whether some surfaces let light pass, so that what occludes nothing may still dim it.
  bool transmits() const { return transmits_; }
  /// The share of light along the ray that passes what it meets before `to`, if it is not occluded.
  float transmittance(Vec3f origin, Vec3f direction, float to) const {
    return transmits_ ? product_of_transmittance(origin, direction, to) : 1.0f;
  }
  /// EmbreeScene::blocker() of static geometry (kNone) or of one object.
  std::optional<Corners> blocker(uint32_t body, Vec3f origin, Vec3f direction, float to) const;
  /// Which of the rays in `wanted` static geometry (or an object) blocks; three times as fast as
  /// single rays. Results depend on the set of rays in a call: for rays that start on a triangle,
  /// lie in its plane or pass through its edge (3e-5 of all, no others), the result may differ when
  /// other rays are traced with them. So `wanted` must depend on the present state only, never on
  /// its history.
  RayBits occluded_static(const RayFan& fan, const RayBits& wanted) const;
  RayBits occluded_object(uint32_t object, const RayFan& fan, const RayBits& wanted) const;

  /// Appends the intervals of origin + t * direction, 0 <= t <= to, that lie inside `object` (unit
  /// direction). None if the object is not closed, see scene::Object.
  void add_inside(uint32_t object, Vec3f origin, Vec3f direction, float to,
                  std::vector<Stretch>& out) const;

  /// World bounds of a movable object, padded by margin(); empty while it is removed. Only for
  /// conservative tests: adding an object may widen the bounds of others.
  const Box& object_bounds(uint32_t object) const { return movables_[object].bounds; }
  /// Boxes that together hold the object, likewise padded: tighter than one around all of it.
  std::vector<Box> part_bounds(uint32_t object) const;
  /// The present movable objects, ascending.
  std::span<const uint32_t> present() const { return present_; }
  /// Padding of bounds: larger than the rounding error of any ray that starts within the scene's
  /// world box. A function of the scene's geometry, however its objects came into it.
  float margin() const { return margin_; }

 private:
  struct Movable {
    EmbreeScene scene;                   ///< in world space; empty while the object is removed
    EmbreeScene solid;                   ///< of closed objects, in local space: for inside tests
    Box box;                             ///< world bounds; empty while the object is removed
    Box bounds;                          ///< the same, padded by the margin
    std::vector<Box> part_boxes;         ///< world bounds of the parts, likewise without padding
    std::shared_ptr<const Parts> parts;  ///< null before the object is first there
    float slack = 0;                     ///< the largest Scene::slack_of() of its triangles
    Pose to_local;
    uint32_t first_primitive = 0;
    std::vector<Vec3f> normal;  ///< by triangle: unit, in world space
  };
  float product_of_transmittance(Vec3f origin, Vec3f direction, float to) const;
  /// The lead of a hit, along the ray.
  float lead(uint32_t object, uint32_t primitive, Vec3f o, Vec3f d, float t) const;
  /// The object of a movable primitive.
  uint32_t object_of(uint32_t primitive) const;
  bool reaches(const Movable& movable, Vec3f origin, Vec3f direction, float to) const;
  /// Brings what depends on all objects up to date: the margin, their bounds, and present_.
  void settle() noexcept;

  EmbreeDevice device_;
  EmbreeScene static_;
  std::vector<Movable> movables_;  // by object; empty entries for static ones
  std::vector<uint32_t> present_;  // present movable objects with triangles, ascending
  float fixed_slack_ = 0;          // the largest Scene::slack_of() of static triangles
  float position_slack_ = 0;       // the largest position_slack() within the world
  uint32_t first_movable_ = 0;     // the first primitive that is not static
  float margin_ = 0;
  bool transmits_ = false;
};

class RayCaster::Saved {
  friend class RayCaster;
  uint32_t object_ = 0;
  Movable movable_;
};

}  // namespace deltalux::trace
