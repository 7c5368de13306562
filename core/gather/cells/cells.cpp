// SPDX-License-Identifier: Apache-2.0
// Cells of all bodies, and the search for the cell where a path lands.
#include "gather/cells/cells.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "gather/cells/cell_tints.h"
#include "gather/cells/exposure.h"

namespace deltalux::gather {
namespace {

constexpr float kStaticEdge = 0.18f;  // scene metres: 0.022 of a room's diagonal
constexpr float kMovableEdge = 0.12f;
constexpr float kShareOfMovable = 0.25f;  // at most this share of the movable's diagonal
constexpr float kNear = 2.0f;             // in units of the square root of a cell's area
constexpr float kNudge = 4.0f;            // multiples of position_slack(), see BodyCells::find

std::vector<BodyCells::Triangle> triangles_of(const scene::Object& object, bool placed) {
  std::vector<BodyCells::Triangle> out;
  out.reserve(object.triangles.size());
  for (size_t t = 0; t < object.triangles.size(); ++t) {
    BodyCells::Triangle triangle{{}, object.material[t]};
    for (int k = 0; k < 3; ++k) {
      const Vec3f p = object.vertices[object.triangles[t][size_t(k)]];
      triangle.corner[k] = placed ? object.pose.point(p) : p;
    }
    out.push_back(triangle);
  }
  return out;
}

}  // namespace

Cells::Cells(const scene::Scene& scene, const trace::RayCaster& caster, float metre,
             const Progress& progress)
    : metre_(metre) {
  std::vector<BodyCells::Triangle> fixed;
  for (const scene::Object& object : scene.objects) {
    if (object.movable) continue;
    const auto own = triangles_of(object, true);
    fixed.insert(fixed.end(), own.begin(), own.end());
  }
  add(scene, scene::kNone, 0, fixed, kStaticEdge * metre, distance_to_surroundings(scene, caster),
      progress);
  body_of_.assign(scene.objects.size(), 0);
  for (uint32_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].movable) add_object(scene, i, progress);
}

void Cells::add_object(const scene::Scene& scene, uint32_t index, const Progress& progress) {
  const scene::Object& object = scene.objects[index];
  body_of_.resize(std::max<size_t>(body_of_.size(), index + 1));
  body_of_[index] = uint32_t(bodies_.size());
  Box box;
  for (const Vec3f& v : object.vertices) box.grow(v);
  const float edge = std::min(kMovableEdge * metre_, kShareOfMovable * box.diagonal());
  add(scene, index, object.first_primitive, triangles_of(object, false), edge, {}, progress);
}

void Cells::add(const scene::Scene& scene, uint32_t object, uint32_t first_primitive,
                std::span<const BodyCells::Triangle> triangles, float edge,
                const Distance& distance, const Progress& progress) {
  BodyCells cells(triangles, edge > 0 ? edge : 1.0f, scene.coincident(object), distance, progress);
  if (uint64_t(size()) + cells.size() >= kNoCell / 2)
    throw SceneError("gather: more than 2e9 cells; bake with gather=\"off\"");
  // Add the body first: if memory runs out afterwards, drop_objects() knows what to remove.
  bodies_.push_back({object, uint32_t(size()), first_primitive, std::move(cells), false});
  const BodyCells& own = bodies_.back().cells;
  for (size_t i = 0; i < own.size(); ++i) {
    area_.push_back(own.areas()[i]);
    near_.push_back(kNear * std::sqrt(own.areas()[i]));
    material_.push_back(own.materials()[i]);
  }
  if (!tint_.empty() || any_varies(scene, triangles)) {
    tint_.resize(bodies_.back().first_cell, {1, 1, 1});
    add_cell_tints(scene, first_primitive, triangles, own, edge, progress, tint_,
                   std::span(area_).subspan(bodies_.back().first_cell));
  }
}

void Cells::expose(const scene::Scene& scene, const trace::RayCaster& caster,
                   const Workers& workers, const Progress& progress) {
  for (Body& body : bodies_) {
    if (std::exchange(body.exposed, true)) continue;
    // In the movable's own space, so that its pose does not matter.
    const bool moves = body.object != scene::kNone;
    const trace::EmbreeScene own =
        moves ? caster.in_own_space(scene, body.object) : trace::EmbreeScene();
    const std::vector<float> shares = exposed_shares(
        scene, body.object, body.cells, near_.data() + body.first_cell,
        [&](Vec3f o, Vec3f w, float to) {
          return moves ? own.closest(0, o, w, 0, to) : caster.closest_static(o, w, 0, to);
        },
        workers, progress);
    for (size_t i = 0; i < shares.size(); ++i) area_[body.first_cell + i] *= shares[i];
  }
}

void Cells::drop_objects(size_t count) {
  while (body_of_.size() > count) {
    const uint32_t body = body_of_.back();
    body_of_.pop_back();
    if (body == 0 || body + 1 != bodies_.size()) continue;
    const uint32_t first = bodies_.back().first_cell;
    area_.resize(first), near_.resize(first), material_.resize(first);
    if (!tint_.empty()) tint_.resize(first, {1, 1, 1});
    bodies_.pop_back();
  }
}

float Cells::edge() const { return kStaticEdge * metre_; }

std::pair<uint32_t, uint32_t> Cells::of_object(uint32_t object) const {
  const Body& body = bodies_[body_of_[object]];
  return {body.first_cell, body.first_cell + uint32_t(body.cells.size())};
}

size_t Cells::bytes() const {
  size_t sum = (area_.capacity() + near_.capacity()) * sizeof(float) +
               material_.capacity() * sizeof(uint32_t) + tint_.capacity() * sizeof(Vec3f);
  for (const Body& body : bodies_) sum += sizeof(Body) + body.cells.bytes();
  return sum;
}

CellFinder::CellFinder(const scene::Scene& scene, const Cells& cells)
    : scene_(scene), cells_(cells) {
  for (const scene::Object& object : scene.objects)
    to_local_.emplace_back(object.movable ? object.pose.inverse() : Pose{});
}

uint32_t CellFinder::find(uint32_t primitive, Vec3f origin, Vec3f w, float t) const {
  const Vec3f at = origin + w * t;
  const float nudge = kNudge * position_slack(at);
  uint32_t cell;
  if (primitive < scene_.static_primitives()) {
    cell = cells_.bodies_[0].cells.find(primitive, at, w, t, nudge);
  } else {
    const uint32_t object = scene_.object_of(primitive);
    const Cells::Body& body = cells_.bodies_[cells_.body_of_[object]];
    const FastTransform& to_local = to_local_[object];
    cell = body.cells.find(primitive - body.first_primitive, to_local.point(at),
                           to_local.direction(w), t, nudge);
    if (cell != kNoCell) cell += body.first_cell;
  }
  return cell;
}

}  // namespace deltalux::gather
