// SPDX-License-Identifier: Apache-2.0
// Numbers primitives, validates scenes, and computes bounds.
#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "base/assertion.h"
#include "base/error.h"
#include "surfaces/texture.h"

namespace deltalux::scene {
namespace {

constexpr const char* kExpected = ", expected a scene in metres";
// Faces that are this share of a body's diagonal apart are examined for overlaps: farther than
// where the probes of cells start above a surface.
constexpr float kWithin = 0x1p-12f;

bool is_near(Vec3f p) {
  return std::fabs(p.x) <= kFarthest && std::fabs(p.y) <= kFarthest && std::fabs(p.z) <= kFarthest;
}

/// Ray queries evaluate n·(corner − origin) with n = e × f in single precision; the terms of that
/// product bound its error. For axis-parallel triangles the larger terms vanish, however long the
/// triangle is. A movable's triangle may be rotated, so all terms count. Corners are rounded, too.
float plane_slack(const Object& object, const std::array<uint32_t, 3>& triangle) {
  // of a sum of products; twice, for the hit and for the ray that leaves
  constexpr double kRounding = 0x1p-21;
  constexpr double kMaxShare =
      1e-4;  // of the longest edge: thinner triangles have no reliable plane
  Vec3d p[3];
  for (int k = 0; k < 3; ++k) {
    const Vec3f local = object.vertices[triangle[k]];
    p[k] = Vec3d(object.movable ? local : object.pose.point(local));
  }
  const Vec3d e = p[1] - p[0], f = p[2] - p[0], g = p[2] - p[1];
  const double longest = std::sqrt(std::max({dot(e, e), dot(f, f), dot(g, g)}));
  const double area = length(cross(e, f));
  double terms = 0;
  if (object.movable) {
    terms = longest * length(e) * length(f);
  } else {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      const double extent = std::max({std::fabs(e[i]), std::fabs(f[i]), std::fabs(g[i])});
      terms += extent * (std::fabs(e[j] * f[k]) + std::fabs(e[k] * f[j]));
    }
  }
  double far = 0;
  for (const Vec3d& corner : p)
    for (int i = 0; i < 3; ++i) far = std::max(far, std::fabs(corner[i]));
  const double slack = area > 0 ? kRounding * terms / area : kMaxShare * longest;
  return float(std::min(slack, kMaxShare * longest) + kRounding * far);
}

CoincidentFaces coincident_of(const std::vector<Face>& body) {
  Box box;
  for (const Face& face : body)
    for (const Vec3f& p : face.corner) box.grow(p);
  return {body, kWithin * box.diagonal()};
}

}  // namespace

std::vector<Vec3f> Object::world_vertices() const {
  std::vector<Vec3f> out(vertices.size());
  for (size_t i = 0; i < vertices.size(); ++i) out[i] = pose.point(vertices[i]);
  return out;
}

Box bounds_at(const Object& object, const Pose& pose) {
  Box box;
  for (const Vec3f& v : object.vertices) box.grow(pose.point(v));
  return box;
}

bool is_closed(const Object& object) {
  std::map<std::array<float, 3>, uint32_t> welded;
  std::map<std::pair<uint32_t, uint32_t>, int64_t> balance;  // by edge, lower vertex first
  double volume = 0;
  for (const auto& triangle : object.triangles) {
    uint32_t id[3];
    for (int k = 0; k < 3; ++k) {
      const Vec3f p = object.vertices[triangle[k]];
      id[k] = welded.try_emplace({p.x, p.y, p.z}, uint32_t(welded.size())).first->second;
    }
    for (int k = 0; k < 3; ++k) {
      const uint32_t a = id[k], b = id[(k + 1) % 3];
      if (a != b) balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
    const Vec3d p(object.vertices[triangle[0]]), q(object.vertices[triangle[1]]),
        r(object.vertices[triangle[2]]);
    volume += dot(p, cross(q, r));
  }
  return volume > 0 && std::all_of(balance.begin(), balance.end(),
                                   [](const auto& edge) { return edge.second == 0; });
}

uint32_t groups_with(const Object& object, uint32_t known) {
  std::set<uint32_t> fresh;
  for (const uint32_t group : object.group)
    if (group >= known) fresh.insert(group);
  if (!fresh.empty() && *fresh.rbegin() - known != fresh.size() - 1)
    throw SceneError("mesh \"" + object.name + "\": found light group " +
                     std::to_string(*fresh.rbegin()) + " beside " + std::to_string(known) +
                     " known ones, expected new groups to be numbered from there without a gap");
  return known + uint32_t(fresh.size());
}

void Scene::check(const Object& object, uint32_t groups) const {
  const std::string what = "mesh \"" + object.name + "\": ";
  for (const auto& triangle : object.triangles)
    for (uint32_t v : triangle)
      if (v >= object.vertices.size())
        throw SceneError(what + "found vertex index " + std::to_string(v) + ", expected below " +
                         std::to_string(object.vertices.size()));
  for (uint32_t m : object.material)
    if (m >= materials.size()) throw SceneError(what + "a material index is out of range");
  if (object.material.size() != object.triangles.size() ||
      object.group.size() != object.triangles.size())
    throw SceneError(what + "expected one material and one group per triangle");
  for (uint32_t g : object.group)
    if (g >= groups) throw SceneError(what + "a light group is out of range");
  if (!object.texture.empty() && object.texture.size() != object.triangles.size())
    throw SceneError(what + "expected texture coordinates of each triangle, or none");
  for (const Vec3f& v : object.vertices)
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      throw SceneError(what + "found a vertex that is not finite, expected finite numbers");
}

void Scene::number(Object& object) {
  const uint64_t next = uint64_t(primitives_) + object.triangles.size();
  if (next >= kNone) throw SceneError("scene: more than 4e9 triangles");
  const bool mapped = !corners_.empty() || !object.texture.empty();
  primitive_.reserve(next);
  if (mapped) corners_.reserve(next);
  object.first_primitive = primitives_;
  for (size_t t = 0; t < object.triangles.size(); ++t)
    primitive_.push_back({object.material[t], plane_slack(object, object.triangles[t])});
  primitives_ = uint32_t(next);
  if (!mapped) return;
  corners_.resize(object.first_primitive);
  for (const auto& own : object.texture) corners_.push_back({own});
  corners_.resize(primitives_);
}

void Scene::finish() {
  primitives_ = static_primitives_ = 0;
  primitive_.clear(), corners_.clear();
  object_of_static_.clear();
  size_t triangles = 0;
  for (const Object& object : objects) triangles += object.triangles.size();
  // Reserve once: number() would reallocate for every object.
  primitive_.reserve(triangles);
  if (std::any_of(objects.begin(), objects.end(),
                  [](const Object& object) { return !object.texture.empty(); }))
    corners_.reserve(triangles);
  bool seen_movable = false;
  for (size_t i = 0; i < objects.size(); ++i) {
    Object& object = objects[i];
    check(object, group_count);
    if (!object.movable && seen_movable)
      throw SceneError("scene: static objects must come before movable ones");
    seen_movable |= object.movable;
    number(object);
    object.closed = object.movable && is_closed(object);
    if (!object.movable) {
      static_primitives_ = primitives_;
      object_of_static_.resize(primitives_, uint32_t(i));
    }
  }
  has_specular_ = transmits_ = false;
  for (const Material& material : materials) {
    has_specular_ |= material.kind->has_specular(material);
    transmits_ |= material.kind->transmits(material);
    const std::string what = "material \"" + material.name + "\": found ";
    if (const char* flaw = material.kind->flaw(material.parameters)) throw SceneError(what + flaw);
  }
  for (const PunctualLight& light : lights) {
    if (!light.kind) throw SceneError("light \"" + light.name + "\": it is of no kind");
    if (const char* flaw = light.kind->flaw(light.parameters))
      throw SceneError("light \"" + light.name + "\": found " + flaw);
    if (light.attached != kNone &&
        (light.attached >= objects.size() || !objects[light.attached].movable))
      throw SceneError("light \"" + light.name + "\": attached to something that is not movable");
    if (light.group >= group_count)
      throw SceneError("light \"" + light.name + "\": its group is out of range");
  }
  for (const PunctualLight& light : lights)
    if (!is_near(Vec3f(light.position)))
      throw SceneError("light \"" + light.name + "\": found a position beyond 1e15 m" + kExpected);
  for (uint32_t i = 0; i < objects.size(); ++i) {
    const Box box = bounds_at(i, objects[i].pose);
    if (!box.empty() && !(is_near(box.low) && is_near(box.high)))
      throw SceneError("mesh \"" + objects[i].name + "\": its pose leads beyond 1e15 m" +
                       kExpected);
  }
  world_ = first_world_ = measure_world();
  coincident_ = coincident_of(faces(kNone));
  coincident_of_.assign(objects.size(), {});
  for (uint32_t i = 0; i < objects.size(); ++i)
    if (objects[i].movable) coincident_of_[i] = coincident_of(faces(i));
}

void Scene::hold(const Box& reached) {
  DELTALUX_ASSERT(reached.empty() || (is_near(reached.low) && is_near(reached.high)));
  world_ = first_world_;
  for (float by = 0.5f * first_world_.diagonal(); !world_.contains(reached); by *= 2)
    world_ = first_world_.padded(by);
}

Face Scene::face_of(const Object& object, size_t triangle) const {
  const Material& material = materials[object.material[triangle]];
  Face face;
  for (size_t k = 0; k < 3; ++k) {
    const Vec3f p = object.vertices[object.triangles[triangle][k]];
    face.corner[k] = object.movable ? p : object.pose.point(p);
  }
  face.emits = material.emission != Vec3f{};
  face.two_sided = face.emits && material.two_sided;
  face.opaque = material.stops_all();
  return face;
}

Face Scene::face(uint32_t movable, uint32_t number) const {
  if (movable != kNone) return face_of(objects[movable], number);
  const Object& object = objects[object_of(number)];
  return face_of(object, number - object.first_primitive);
}

std::vector<Face> Scene::faces(uint32_t movable) const {
  std::vector<Face> out;
  const size_t count = movable == kNone ? static_primitives_ : objects[movable].triangles.size();
  for (uint32_t i = 0; i < count; ++i) out.push_back(face(movable, i));
  return out;
}

uint32_t Scene::add_object(Object object) {
  const uint32_t groups = groups_with(object, group_count);
  check(object, groups);
  object.movable = true;
  object.closed = is_closed(object);
  std::vector<Face> own;
  for (size_t t = 0; t < object.triangles.size(); ++t) own.push_back(face_of(object, t));
  CoincidentFaces coincident = coincident_of(own);
  // Nothing may fail after the primitives are numbered.
  objects.reserve(objects.size() + 1), coincident_of_.reserve(objects.size() + 1);
  number(object);
  objects.push_back(std::move(object));
  coincident_of_.push_back(std::move(coincident));
  group_count = groups;
  return uint32_t(objects.size() - 1);
}

void Scene::drop_last_object() {
  primitives_ = objects.back().first_primitive;
  primitive_.resize(primitives_);
  corners_.resize(std::min<size_t>(corners_.size(), primitives_));
  objects.pop_back();
  coincident_of_.pop_back();
}

std::array<float, 2> Scene::texture_at(uint32_t primitive, float u, float v) const {
  if (corners_.empty()) return Corners::kNone;
  const auto& corner = corners_[primitive].corner;
  std::array<float, 2> at;
  for (size_t k = 0; k < 2; ++k)
    at[k] = corner[0][k] + u * (corner[1][k] - corner[0][k]) + v * (corner[2][k] - corner[0][k]);
  return at;
}

uint32_t Scene::object_of(uint32_t primitive) const {
  DELTALUX_ASSERT(primitive < primitives_);
  if (primitive < static_primitives_) return object_of_static_[primitive];
  uint32_t low = 0, high = uint32_t(objects.size());
  while (high - low > 1) {
    const uint32_t middle = (low + high) / 2;
    (objects[middle].first_primitive <= primitive ? low : high) = middle;
  }
  return low;
}

Box Scene::measure_world() const {
  Box box;
  for (const Object& object : objects)
    if (!object.movable) box.grow(scene::bounds_at(object, object.pose));
  if (!box.empty()) {
    // Extend flat scenes (a bare floor) above and below.
    const Vec3f e = box.extent();
    const float least = 0.25f * std::max({e.x, e.y, e.z, 1e-6f});
    for (int axis = 0; axis < 3; ++axis) {
      const float grow = 0.02f * e[axis] + std::max(0.0f, least - 0.5f * e[axis]);
      box.low[axis] -= grow, box.high[axis] += grow;
    }
  }
  for (uint32_t i = 0; i < objects.size(); ++i) {
    if (!objects[i].movable) continue;
    const Box own = bounds_at(i, objects[i].pose);
    if (!box.contains(own)) box.grow(own.padded(0.05f * own.diagonal()));
  }
  for (const PunctualLight& light : lights)
    if (!light.kind->is_parallel() && light.attached == kNone) box.grow(Vec3f(light.position));
  if (box.empty()) box = {{-1, -1, -1}, {1, 1, 1}};
  return box;
}

Box Scene::bounds_at(uint32_t object, const Pose& pose) const {
  Box box = scene::bounds_at(objects[object], pose);
  for (const PunctualLight& light : lights)
    if (light.attached == object && !light.kind->is_parallel())
      box.grow(pose.point(Vec3f(light.position)));
  return box;
}

void Scene::set_world(const Box& world) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(world.low[axis] < world.high[axis]) || !std::isfinite(world.high[axis] - world.low[axis]))
      throw SceneError("scene: its box is not finite");
  world_ = first_world_ = world;
}

uint32_t Scene::groups_up_to(uint32_t object) const {
  uint32_t last = 0;
  for (const PunctualLight& light : lights) last = std::max(last, light.group);
  for (uint32_t i = 0; i <= object; ++i)
    for (const uint32_t group : objects[i].group) last = std::max(last, group);
  return last + 1;
}

size_t Scene::texture_bytes() const {
  std::set<const surfaces::Texture*> all;
  for (const Material& material : materials)
    for (const auto& map : {material.map, material.glow})
      if (map) all.insert(map->texture.get());
  size_t sum = 0;
  for (const surfaces::Texture* texture : all) sum += texture->bytes();
  return sum;
}

double Scene::area() const {
  double sum = 0;
  for (const Object& object : objects)
    for (const auto& t : object.triangles) {
      const Vec3d a(object.vertices[t[0]]), b(object.vertices[t[1]]), c(object.vertices[t[2]]);
      sum += 0.5 * length(cross(b - a, c - a));
    }
  return sum;
}

}  // namespace deltalux::scene
