// SPDX-License-Identifier: Apache-2.0
// Probes of squares, points of small triangles by their area.
#include "gather/lit_cells.h"

#include <bit>

#include "base/random.h"

namespace deltalux::gather {
namespace {

constexpr size_t kPilots = 1024;  // places, at most

}  // namespace

LitCells::LitCells(const Present& present, const Evaluation& evaluation,
                   std::span<const uint16_t> covered)
    : scene_(present.scene) {
  present.cells.each_body([&](uint32_t first, uint32_t object, const BodyCells& body) {
    const bool moves = object != scene::kNone;
    if (moves && !scene_.objects[object].present) return;
    const auto number = uint32_t(bodies_.size());
    bodies_.push_back({&body,
                       object,
                       moves ? scene_.objects[object].first_primitive : 0,
                       moves ? scene_.objects[object].pose : Pose{},
                       {},
                       {}});
    bool small = false;
    for (uint32_t own = 0; own < body.size(); ++own) {
      const uint32_t cell = first + own;
      if (!(evaluation.brightness(cell) > 0)) continue;
      if (std::countr_one(covered[cell]) >= int(kPlaces)) continue;
      small |= !body.has_probes(own);
      cells_.push_back({cell, own, number, covered[cell]});
    }
    if (small) body.sort_small(bodies_.back().triangles, bodies_.back().begin);
  });
}

direct::Receiver LitCells::place(size_t i, uint32_t from) const {
  const Cell& cell = cells_[i];
  const Body& body = bodies_[cell.body];
  if (!body.cells->has_probes(cell.own)) return on_small(body, cell.own, from);
  while (cell.covered >> from & 1) from = (from + 1) % kPlaces;
  const Vec3f p = body.cells->probe(cell.own, from), n = body.cells->normal(cell.own);
  return {body.pose.point(p), body.pose.direction(n), body.object, body.cells->rise(),
          direct::place_key(p, n)};
}

direct::Receiver LitCells::on_small(const Body& body, uint32_t own, uint32_t from) const {
  // Where in the sum of the areas, and where on the triangle that is there.
  const PathRandom random(0x706c616365ull, own);
  const auto at = [&](uint32_t triangle, Vec3f(&corner)[3]) {
    const uint32_t primitive = body.first_primitive + triangle;
    const scene::Object& object = scene_.objects[scene_.object_of(primitive)];
    const auto& indices = object.triangles[primitive - object.first_primitive];
    for (size_t k = 0; k < 3; ++k) corner[k] = object.pose.point(object.vertices[indices[k]]);
    return cross(corner[1] - corner[0], corner[2] - corner[0]);
  };
  Vec3f corner[3];
  const auto first = body.begin[own], end = body.begin[own + 1];
  double all = 0;
  for (uint32_t k = first; k < end; ++k) all += double(length(at(body.triangles[k], corner)));
  double left = all * (double(from) + double(random(from, 0))) / kPlaces;
  uint32_t chosen = first;
  for (uint32_t k = first; k < end; ++k) {
    const double area = double(length(at(body.triangles[k], corner)));
    if (!(area > 0)) continue;
    chosen = k;
    if ((left -= area) < 0) break;
  }
  const Vec3f across = at(body.triangles[chosen], corner);
  const float u = std::sqrt(random(from, 1)), v = random(from, 2);
  const Vec3f p =
      corner[0] + (corner[1] - corner[0]) * (u * (1 - v)) + (corner[2] - corner[0]) * (u * v);
  const Vec3f n = normalize(body.cells->is_back(own) ? -across : across);
  const float plane = scene_.slack_of(body.first_primitive + body.triangles[chosen]);
  return {p, n, body.object, plane, combine(own, from)};
}

std::vector<direct::Receiver> lit_places(const LitCells& lit) {
  std::vector<direct::Receiver> out;
  const size_t step = (lit.size() + kPilots - 1) / kPilots;
  for (size_t i = 0; i < lit.size(); i += step) out.push_back(lit.place(i, 0));
  return out;
}

}  // namespace deltalux::gather
