// SPDX-License-Identifier: Apache-2.0
// Distributes queries over acceleration structures and combines their results.
#include "trace/ray_caster.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/assertion.h"
#include "base/end_slack.h"

namespace deltalux::trace {

namespace {

constexpr float kFlat = 1.0f / 16;  // cosine: for flatter rays the lead grows no more
constexpr float kMostLead = 16;     // in units of slack_at()

/// Of the hit at distance `t` of a ray, as in surface_slack().
float slack_at(Vec3f o, Vec3f d, float t) { return end_slack(o + d * t, d * t); }

/// The largest slack of `count` primitives.
float slack_of(const scene::Scene& scene, uint32_t first, size_t count) {
  float most = 0;
  for (uint32_t i = first; i < first + count; ++i) most = std::max(most, scene.slack_of(i));
  return most;
}

/// The holes of one object, or with kNone of all static ones; none if rays stop at all surfaces.
std::optional<Holes> holes_of(const scene::Scene& scene, uint32_t index) {
  const auto lets_pass = [&](const scene::Object& object) {
    return std::any_of(object.material.begin(), object.material.end(),
                       [&](uint32_t m) { return !scene.materials[m].stops_all(); });
  };
  const bool all_static = index == scene::kNone;
  Holes holes{nullptr, all_static ? 0 : scene.objects[index].first_primitive, nullptr};
  for (uint32_t i = 0; i < scene.objects.size(); ++i)
    if (all_static ? !scene.objects[i].movable : i == index)
      if (lets_pass(scene.objects[i])) holes.scene = &scene;
  if (!scene.coincident(index).empty()) {
    auto hidden = std::make_shared<const HiddenParts>(scene.faces(index), scene.coincident(index));
    if (hidden->size()) holes.hidden = std::move(hidden);
  }
  holes.transmits = holes.scene && scene.transmits();
  return holes.scene || holes.hidden ? std::optional(holes) : std::nullopt;
}

}  // namespace

RayCaster::RayCaster(const scene::Scene& scene, Progress& progress) {
  std::vector<Vec3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  triangles.reserve(scene.static_primitives());
  for (const scene::Object& object : scene.objects) {
    if (object.movable) continue;
    const uint32_t base = uint32_t(vertices.size());
    for (const Vec3f& v : object.world_vertices()) vertices.push_back(v);
    for (const auto& t : object.triangles)
      triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  }
  static_ = EmbreeScene(device_, vertices, triangles, &progress, holes_of(scene, scene::kNone));
  fixed_slack_ = slack_of(scene, 0, scene.static_primitives());
  position_slack_ = position_slack({scene.world().reach(), 0, 0});
  transmits_ = scene.transmits();
  first_movable_ = scene.static_primitives();
  movables_.resize(scene.objects.size());
  for (uint32_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].movable) update_object(scene, i);
  settle();
}

void RayCaster::update_object(const scene::Scene& scene, uint32_t index) {
  const scene::Object& object = scene.objects[index];
  present_.reserve(scene.objects.size());
  Movable fresh;
  fresh.first_primitive = object.first_primitive;
  fresh.to_local = object.pose.inverse();
  fresh.slack = slack_of(scene, object.first_primitive, object.triangles.size());
  if (index < movables_.size()) {
    fresh.solid = movables_[index].solid;
    fresh.parts = movables_[index].parts;
  }
  if (object.closed && !fresh.solid)
    fresh.solid = EmbreeScene(device_, object.vertices, object.triangles, nullptr);
  if (object.present && !object.triangles.empty()) {
    const std::vector<Vec3f> vertices = object.world_vertices();
    fresh.scene = EmbreeScene(device_, vertices, object.triangles, nullptr, holes_of(scene, index));
    for (const Vec3f& v : vertices) fresh.box.grow(v);
    if (!fresh.parts)
      fresh.parts = std::make_shared<const Parts>(object.vertices, object.triangles);
    fresh.part_boxes = fresh.parts->boxes(vertices, object.triangles);
    for (const auto& t : object.triangles)
      fresh.normal.push_back(
          normalize(cross(vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]])));
  }
  if (movables_.size() <= index) movables_.resize(index + 1);
  movables_[index] = std::move(fresh);
  settle();
}

std::vector<Box> RayCaster::part_bounds(uint32_t object) const {
  std::vector<Box> out = movables_[object].part_boxes;
  for (Box& box : out) box = box.padded(margin_);
  return out;
}

EmbreeScene RayCaster::in_own_space(const scene::Scene& scene, uint32_t index) const {
  const scene::Object& object = scene.objects[index];
  return EmbreeScene(device_, object.vertices, object.triangles, nullptr, holes_of(scene, index));
}

RayCaster::Saved RayCaster::save_object(uint32_t object) const {
  DELTALUX_ASSERT(object < movables_.size());
  Saved saved;
  saved.object_ = object;
  saved.movable_ = movables_[object];
  return saved;
}

void RayCaster::put_back(Saved&& saved) noexcept {
  DELTALUX_ASSERT(saved.object_ < movables_.size());
  movables_[saved.object_] = std::move(saved.movable_);
  settle();
}

void RayCaster::drop_objects(size_t count) noexcept {
  if (count < movables_.size()) movables_.erase(movables_.begin() + long(count), movables_.end());
  settle();
}

void RayCaster::settle() noexcept {
  margin_ = fixed_slack_;
  for (const Movable& movable : movables_) margin_ = std::max(margin_, movable.slack);
  margin_ += position_slack_;
  present_.clear();  // capacity was reserved before
  for (uint32_t i = 0; i < movables_.size(); ++i) {
    movables_[i].bounds = movables_[i].box.padded(margin_);
    if (movables_[i].scene) present_.push_back(i);
  }
}

bool RayCaster::reaches(const Movable& movable, Vec3f origin, Vec3f direction, float to) const {
  return SlabRay(origin, direction).entry(movable.bounds, to) <
         std::numeric_limits<float>::infinity();
}

Hit RayCaster::closest_static(Vec3f o, Vec3f d, float from, float to) const {
  return static_.closest(0, o, d, from, to);
}

Hit RayCaster::closest_object(uint32_t object, Vec3f o, Vec3f d, float from, float to) const {
  DELTALUX_ASSERT(object < movables_.size());
  const Movable& movable = movables_[object];
  if (!movable.scene) return {};
  return movable.scene.closest(movable.first_primitive, o, d, from, to);
}

uint32_t RayCaster::object_of(uint32_t primitive) const {
  const auto behind =
      std::upper_bound(present_.begin(), present_.end(), primitive,
                       [&](uint32_t p, uint32_t i) { return p < movables_[i].first_primitive; });
  return *(behind - 1);
}

float RayCaster::lead(uint32_t object, uint32_t primitive, Vec3f o, Vec3f d, float t) const {
  const Movable& movable = movables_[object];
  const float cosine = std::fabs(dot(movable.normal[primitive - movable.first_primitive], d));
  // The normal of a triangle without area is not a number.
  return lead(object) * slack_at(o, d, t) / (cosine > kFlat ? cosine : kFlat);
}

Hit RayCaster::closer(const Hit& best, uint32_t object, Vec3f o, Vec3f d, float from,
                      float to) const {
  DELTALUX_ASSERT(object < movables_.size());
  const Movable& movable = movables_[object];
  // No lead is larger.
  const float most = best.valid() ? kMostLead * slack_at(o, d, best.t) : 0.0f;
  // Skipping an object by its padded box is safe: if the box is beyond `best`, its triangles are
  // strictly beyond.
  if (!movable.scene || !reaches(movable, o, d, std::min(best.t + most, to))) return best;
  const Hit hit = closest_object(object, o, d, from, to);
  if (!hit.valid()) return best;
  if (!best.valid() || hit.t < best.t - most) return hit;
  if (hit.t > best.t + most) return best;
  const float own = hit.t - lead(object, hit.primitive, o, d, hit.t);
  const bool moves = best.primitive >= first_movable_;
  const float other =
      moves ? best.t - lead(object_of(best.primitive), best.primitive, o, d, best.t) : best.t;
  return own < other || (own == other && hit.primitive < best.primitive) ? hit : best;
}

Hit RayCaster::closest(Vec3f o, Vec3f d, float from, float to) const {
  Hit best = closest_static(o, d, from, to);
  for (uint32_t object : present_) best = closer(best, object, o, d, from, to);
  return best;
}

bool RayCaster::occluded_static(Vec3f o, Vec3f d, float to) const {
  return static_.occluded(o, d, to);
}

bool RayCaster::occluded_object(uint32_t object, Vec3f o, Vec3f d, float to) const {
  DELTALUX_ASSERT(object < movables_.size());
  const Movable& movable = movables_[object];
  return movable.scene && reaches(movable, o, d, to) && movable.scene.occluded(o, d, to);
}

bool RayCaster::occluded(Vec3f o, Vec3f d, float to) const {
  if (occluded_static(o, d, to)) return true;
  for (uint32_t object : present_)
    if (occluded_object(object, o, d, to)) return true;
  return false;
}

float RayCaster::product_of_transmittance(Vec3f o, Vec3f d, float to) const {
  float product = static_.transmittance(o, d, to);
  for (uint32_t object : present_)
    if (const Movable& movable = movables_[object]; reaches(movable, o, d, to))
      product *= movable.scene.transmittance(o, d, to);
  return product;
}

std::optional<Corners> RayCaster::blocker(uint32_t body, Vec3f o, Vec3f d, float to) const {
  if (body == scene::kNone) return static_.blocker(o, d, to);
  DELTALUX_ASSERT(body < movables_.size());
  const Movable& movable = movables_[body];
  if (!movable.scene || !reaches(movable, o, d, to)) return {};
  return movable.scene.blocker(o, d, to);
}

RayBits RayCaster::occluded_static(const RayFan& fan, const RayBits& wanted) const {
  return static_.occluded(fan, wanted);
}

RayBits RayCaster::occluded_object(uint32_t object, const RayFan& fan,
                                   const RayBits& wanted) const {
  DELTALUX_ASSERT(object < movables_.size());
  const Movable& movable = movables_[object];
  if (!movable.scene) return {};
  return movable.scene.occluded(fan, wanted);
}

void RayCaster::add_inside(uint32_t object, Vec3f o, Vec3f d, float to,
                           std::vector<Stretch>& out) const {
  // intersections; an object with more of them on one line is treated as not closed
  constexpr size_t kMaxIntersections = 512;
  constexpr int kTries = 4;
  const Movable& movable = movables_[object];
  if (!movable.scene || !movable.solid || !reaches(movable, o, d, to)) return;
  // Examine the whole line, from before the object: every entry must have an exit.
  const float before = movable.box.diagonal() + length(movable.box.centre() - o);
  const Vec3f from = movable.to_local.point(o);
  std::array<Intersection, kMaxIntersections> intersections;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    // A line through an edge may hit one of its triangles or both; then retry with a line slightly
    // beside it.
    const float aside = 1e-4f * float(attempt);
    const Vec3f turned = movable.to_local.direction(d) + Vec3f{aside, -aside, 0.5f * aside};
    const Vec3f w = normalize(turned);
    const size_t count = movable.solid.intersections(from - w * before, w, intersections);
    if (count == kMaxIntersections) return;
    const auto end = intersections.begin() + long(count);
    std::sort(intersections.begin(), end, [](const Intersection& a, const Intersection& b) {
      return a.t != b.t ? a.t < b.t : a.primitive < b.primitive;
    });
    int sum = 0;
    for (size_t i = 0; i < count; ++i) sum += intersections[i].into;
    if (sum != 0) continue;
    int winding = 0;
    for (size_t i = 0; i + 1 < count; ++i) {
      winding += intersections[i].into;
      const Stretch inside{std::max(0.0f, intersections[i].t - before),
                           std::min(to, intersections[i + 1].t - before)};
      if (winding != 0 && inside.begin < inside.end) out.push_back(inside);
    }
    return;
  }
}

}  // namespace deltalux::trace
