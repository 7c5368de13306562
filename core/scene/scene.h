// SPDX-License-Identifier: Apache-2.0
// The scene of the core: objects made of triangles, materials, punctual lights.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/assertion.h"
#include "base/transform.h"
#include "base/vec.h"
#include "lights/kind.h"
#include "scene/coincident_faces.h"
#include "surfaces/kind.h"

namespace deltalux::scene {

inline constexpr uint32_t kNone = 0xffffffffu;

using Material = surfaces::Surface;

struct Object {
  std::string name;
  std::vector<Vec3f> vertices;                     ///< local
  std::vector<std::array<uint32_t, 3>> triangles;  ///< front side = counter-clockwise
  std::vector<uint32_t> material;                  ///< per triangle
  std::vector<uint32_t> group;  ///< light group of each triangle, used if it emits
  /// Texture coordinates of each triangle's corners, not finite where there are none; may be empty.
  std::vector<std::array<std::array<float, 2>, 3>> texture{};
  bool movable = false;
  bool present = true;  ///< false while removed by an edit
  Pose pose;
  uint32_t first_primitive = 0;
  bool closed = false;  ///< movables only: whether it has an inside, see is_closed()

  std::vector<Vec3f> world_vertices() const;
};

struct PunctualLight {
  std::string name;
  const lights::Kind* kind = nullptr;
  Vec3d position{}, direction{0, -1, 0};  ///< local to `attached`, otherwise world
  Vec3f intensity;                        ///< see lights::Punctual
  std::vector<float> parameters;          ///< additional parameters of its kind
  uint32_t attached = kNone;              ///< index of the object that carries it
  uint32_t group = 0;
};

Box bounds_at(const Object& object, const Pose& pose);
/// Whether `object` has an inside and is wound outwards: each edge (by position) is traversed
/// equally often in both directions, and the signed volume is positive. It may consist of several
/// bodies, which may touch, overlap or be nested.
bool is_closed(const Object& object);

/// Number of light groups once `object` is added to a scene with `known` groups: those of its
/// groups that are not below `known` are new. Throws SceneError if new ones are not numbered
/// without a gap.
uint32_t groups_with(const Object& object, uint32_t known);

/// Static objects come first. Primitives are numbered through all objects in that order, so a
/// primitive is static exactly if it is below static_primitives(). Objects added later come last.
class Scene {
 public:
  std::vector<Object> objects;
  std::vector<Material> materials;
  std::vector<PunctualLight> lights;
  uint32_t group_count = 1;

  /// Numbers the primitives and checks indices. Throws SceneError.
  void finish();
  /// Throws SceneError if `object` is malformed or refers to materials that do not exist, or to
  /// groups other than the first `groups`.
  void check(const Object& object, uint32_t groups) const;
  /// Appends a movable object, with the light groups that it brings; returns its index. Throws
  /// SceneError.
  uint32_t add_object(Object object);
  /// Removes the object that was added last, but no light groups.
  void drop_last_object();

  uint32_t static_primitives() const { return static_primitives_; }
  uint32_t primitives() const { return primitives_; }
  uint32_t object_of(uint32_t primitive) const;
  const Material& material_of(uint32_t primitive) const {
    return materials[material_index(primitive)];
  }
  uint32_t material_index(uint32_t primitive) const {
    DELTALUX_ASSERT(primitive < primitives_);
    return primitive_[primitive].material;
  }
  /// The point with barycentrics u and v on a primitive, with what its surface reads of it.
  surfaces::SurfacePoint point_on(uint32_t primitive, float u, float v) const {
    surfaces::SurfacePoint at{u, v, {}};
    if (material_of(primitive).kind->reads() == surfaces::Reads::texture)
      at.texture = texture_at(primitive, u, v);
    return at;
  }
  /// Begins to bring into the cache what point_on() reads of a primitive; what tint_at() reads
  /// then.
  void fetch_point(uint32_t primitive) const {
    if (!corners_.empty()) __builtin_prefetch(&corners_[primitive]);
  }
  void fetch_tint(uint32_t primitive, float u, float v) const {
    if (corners_.empty()) return;
    const Material& own = material_of(primitive);
    own.kind->fetch(own, point_on(primitive, u, v));
  }
  /// Whether rays pass straight through the primitive at that point, as through nothing.
  bool lets_pass(uint32_t primitive, float u, float v) const {
    const Material& own = material_of(primitive);
    return !own.kind->is_opaque(own) && !own.kind->stops(own, point_on(primitive, u, v));
  }
  /// Kind::tint() of the primitive's surface at that point.
  Vec3f tint_at(uint32_t primitive, float u, float v) const {
    const Material& own = material_of(primitive);
    if (!own.varies()) return {1, 1, 1};
    return own.kind->tint(own, point_on(primitive, u, v));
  }
  /// Kind::diffuse_share() of the primitive's surface at that point.
  double diffuse_share(uint32_t primitive, float u, float v) const {
    const Material& own = material_of(primitive);
    return own.has_lobes() ? double(own.kind->diffuse_share(own, point_on(primitive, u, v))) : 1.0;
  }
  /// Whether light may go on from the primitive in another lobe than the diffuse one.
  bool has_lobes(uint32_t primitive) const {
    return (has_specular_ || transmits_) && material_of(primitive).has_lobes();
  }
  /// Whether any surface has a specular lobe; whether any lets light pass straight.
  bool has_specular() const { return has_specular_; }
  bool transmits() const { return transmits_; }
  /// Bound of the rounding error of a primitive's plane in ray queries, in any pose: for large
  /// tilted triangles and slivers it exceeds position_slack() of a point on them.
  float slack_of(uint32_t primitive) const {
    DELTALUX_ASSERT(primitive < primitives_);
    return primitive_[primitive].slack;
  }
  /// Faces that lie in one place: those of all static objects, by primitive (kNone), or of one
  /// movable, by triangle.
  const CoincidentFaces& coincident(uint32_t movable) const {
    return movable == kNone ? coincident_ : coincident_of_[movable];
  }
  /// The triangles of all static objects, in world space (kNone), or of one movable, in its own;
  /// and one of them.
  std::vector<Face> faces(uint32_t movable) const;
  Face face(uint32_t movable, uint32_t number) const;
  /// The box that finish() fixes, from static geometry alone if that encloses the movables.
  /// Whatever is chosen once by the size of the scene depends on it, and suns' paths start on its
  /// outline.
  const Box& first_world() const { return first_world_; }
  /// The box that contains all light paths at present: first_world(), or a larger one around it,
  /// see hold(). A function of that box and of the present places, whatever was held before.
  const Box& world() const { return world_; }
  /// A distance from anything in the world that lies outside of it.
  float beyond() const { return 2 * world_.diagonal(); }
  /// Extends the first world box, before anything was chosen by it.
  void extend_world(const Box& box) { first_world_.grow(box), world_ = first_world_; }
  /// Sets the first world box of a finished scene to which objects were added. Throws SceneError.
  void set_world(const Box& world);
  /// Makes world() hold everything in `reached`, by padding first_world() by half its diagonal, or
  /// by twice, four times … as much.
  void hold(const Box& reached);
  /// Bounds of `object` at `pose`, including the positions of lights that it carries.
  Box bounds_at(uint32_t object, const Pose& pose) const;
  /// Number of light groups of the lights and the objects up to this one: when an object is added,
  /// that is the number there is then, whatever is added after it.
  uint32_t groups_up_to(uint32_t object) const;
  /// Total area of all triangles, in square metres.
  double area() const;
  /// Memory of the textures of all materials, each counted once.
  size_t texture_bytes() const;

 private:
  /// Assigns primitive numbers to an object.
  void number(Object& object);
  Face face_of(const Object& object, size_t triangle) const;
  Box measure_world() const;
  std::array<float, 2> texture_at(uint32_t primitive, float u, float v) const;

  /// Object::texture of a triangle, at a multiple of its size: one cache line has it.
  struct alignas(32) Corners {
    static constexpr std::array<float, 2> kNone{std::numeric_limits<float>::quiet_NaN(),
                                                std::numeric_limits<float>::quiet_NaN()};
    std::array<std::array<float, 2>, 3> corner{kNone, kNone, kNone};
  };
  std::vector<uint32_t> object_of_static_;  // by static primitive
  struct Primitive {
    uint32_t material;
    float slack;
  };
  std::vector<Primitive> primitive_;
  std::vector<Corners> corners_;  // by primitive; empty while no object has texture coordinates
  uint32_t static_primitives_ = 0, primitives_ = 0;
  bool has_specular_ = false, transmits_ = false;
  CoincidentFaces coincident_;                  // of static objects
  std::vector<CoincidentFaces> coincident_of_;  // by object; empty for static ones
  Box first_world_, world_;
};

}  // namespace deltalux::scene
