// SPDX-License-Identifier: Apache-2.0
// The scene as the core sees it: objects of triangles, diffuse materials, punctual lights.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/transform.h"
#include "base/vec.h"
#include "lights/kind.h"

namespace deltalux::scene {

inline constexpr uint32_t kNone = 0xffffffffu;

struct Material {
  Vec3f reflectance;
  Vec3f emission;  ///< radiance per channel
  bool two_sided = false;
};

struct Object {
  std::string name;
  std::vector<Vec3f> vertices;                     ///< local
  std::vector<std::array<uint32_t, 3>> triangles;  ///< front = counter-clockwise
  std::vector<uint32_t> material;                  ///< per triangle
  std::vector<uint32_t> group;                     ///< light group per triangle (emissive ones)
  bool movable = false;
  bool present = true;  ///< false after `remove`
  Pose pose;
  uint32_t first_primitive = 0;
  bool closed = false;  ///< of movables: has an inside, see is_closed()

  std::vector<Vec3f> world_vertices() const;
};

struct PunctualLight {
  std::string name;
  const lights::Kind* kind = nullptr;
  Vec3d position{}, direction{0, -1, 0};  ///< local to `attached`, else world
  Vec3f intensity;                        ///< see lights::Punctual
  std::vector<float> parameters;          ///< what its kind has besides
  uint32_t attached = kNone;              ///< object
  uint32_t group = 0;
};

Box bounds_at(const Object& object, const Pose& pose);
/// Whether `object` has an inside, wound outwards: each edge (by position) is run through as often
/// in one direction as in the other. Several bodies count, touching, overlapping or nested.
bool is_closed(const Object& object);

/// Objects are ordered static first; primitives are numbered through all objects in that order, so
/// primitive < static_primitives() iff it is static. Objects added later come last.
class Scene {
 public:
  std::vector<Object> objects;
  std::vector<Material> materials;
  std::vector<PunctualLight> lights;
  uint32_t group_count = 1;

  /// Numbers the primitives and checks indices. Throws SceneError.
  void finish();
  /// Throws SceneError where `object` is malformed or refers to materials or groups that are not
  /// here.
  void check(const Object& object) const;
  /// Appends a movable object. Throws SceneError.
  uint32_t add_object(Object object);
  /// Takes the object that was added last back out.
  void drop_last_object();

  uint32_t static_primitives() const { return static_primitives_; }
  uint32_t primitives() const { return primitives_; }
  uint32_t object_of(uint32_t primitive) const;
  const Material& material_of(uint32_t primitive) const {
    return materials[material_index(primitive)];
  }
  uint32_t material_index(uint32_t primitive) const { return primitive_[primitive].material; }
  /// Distance by which rounding may put the plane of `primitive` off, as rays meet it: of large
  /// tilted triangles and slivers more than position_slack() of a point on them. In any pose.
  float slack_of(uint32_t primitive) const { return primitive_[primitive].slack; }
  /// The box that light paths live in: fixed when the scene is finished, from static geometry
  /// alone where that encloses the movables, so that it does not depend on where they stand.
  const Box& world() const { return world_; }
  /// Light paths go on to what lies in `box`, too.
  void extend_world(const Box& box) { world_.grow(box); }
  /// For a scene that was finished before, with objects that were added since. Throws SceneError.
  void set_world(const Box& world);
  /// What `object` takes up at `pose`, the bulbs and spots that it carries included.
  Box bounds_at(uint32_t object, const Pose& pose) const;
  /// Sum of all triangle areas, square metres.
  double area() const;

 private:
  void number(Object& object);
  Box measure_world() const;

  std::vector<uint32_t> object_of_static_;  // per static primitive
  struct Primitive {
    uint32_t material;
    float slack;
  };
  std::vector<Primitive> primitive_;
  uint32_t static_primitives_ = 0, primitives_ = 0;
  Box world_;
};

}  // namespace deltalux::scene
