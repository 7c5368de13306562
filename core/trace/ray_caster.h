// SPDX-License-Identifier: Apache-2.0
// Ray queries. Only ray_caster.cpp knows Embree (3.13 or 4).
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/vec.h"
#include "scene/scene.h"

namespace deltalux::trace {

struct Hit {
  float t = std::numeric_limits<float>::infinity();
  uint32_t primitive = scene::kNone;  ///< of Scene's numbering
  Vec3f normal{};                     ///< geometric, follows the winding, not normalised
  bool valid() const { return primitive != scene::kNone; }
};

/// Shadow rays from one point: origin + t * (x, y, z)[i] for 0 < t <= to.
struct RayFan {
  static constexpr size_t kMost = 256;
  Vec3f origin;
  float to = 1;
  size_t count = 0;
  alignas(64) std::array<float, kMost> x, y, z;  ///< need not be normalised
};
using RayBits = std::array<uint64_t, RayFan::kMost / 64>;  ///< one bit per ray of a fan

/// Closest hit = the least (t, rank) over the static scene (rank 0) and each present movable
/// object in its own acceleration structure (rank 1 + object), every one of them queried over the
/// whole ray. So a hit is a pure function of the ray and of each object's pose: what one object
/// does never changes the bits that another returns.
class RayCaster {
 public:
  RayCaster(const scene::Scene& scene, Progress& progress);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// Commits `object` (movable, possibly new) in its present pose. Not while queries run.
  void update_object(const scene::Scene& scene, uint32_t object);
  /// Forgets objects from number `count` on.
  void drop_objects(size_t count);

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
  bool occluded_movable(Vec3f origin, Vec3f direction, float to) const;
  /// The rays in `wanted` that the static scene (an object) blocks; three times faster than single
  /// rays. The answers belong to the fan as a whole: rays that begin on a triangle, lie in its
  /// plane or pass through its edge (3e-5 of them, no others) are answered otherwise in other
  /// company. So let `wanted` follow from the present state alone, never from its history.
  RayBits occluded_static(const RayFan& fan, const RayBits& wanted) const;
  RayBits occluded_object(uint32_t object, const RayFan& fan, const RayBits& wanted) const;

  /// World bounds of a movable object, a little larger than its triangles; empty when removed.
  const Box& object_bounds(uint32_t object) const { return movables_[object].bounds; }
  std::span<const uint32_t> present() const { return present_; }
  /// Origins of bounced rays leave their surface by this much.
  float epsilon() const { return epsilon_; }
  /// Embree's version, the instruction set in use and this library's build.
  std::string description() const;

 private:
  struct Device;
  struct Movable {
    void* scene = nullptr;  // RTCScene
    Box bounds;
    uint32_t first_primitive = 0;
  };
  bool reaches(const Movable& movable, Vec3f origin, Vec3f direction, float to) const;

  std::unique_ptr<Device> device_;
  std::vector<Movable> movables_;  // per object; static ones stay empty
  std::vector<uint32_t> present_;  // movable objects with triangles, ascending
  float epsilon_ = 1e-4f;
};

}  // namespace deltalux::trace
