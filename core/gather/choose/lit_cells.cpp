// SPDX-License-Identifier: Apache-2.0
// Places on lit cells: probes on squares; on small triangles, points distributed by area.
#include "gather/choose/lit_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/random.h"

namespace deltalux::gather {
namespace {

constexpr size_t kPilots = 1024;  // places that cast pilot rays, at most

}  // namespace

LitCells::LitCells(const Context& context, const Evaluation& evaluation,
                   std::span<const uint16_t> covered)
    : scene_(context.scene) {
  context.cells.each_body([&](uint32_t first, uint32_t object, const BodyCells& body) {
    const bool moves = object != scene::kNone;
    if (moves && !scene_.objects[object].present) return;
    const auto number = uint32_t(bodies_.size());
    Body& placed = bodies_.emplace_back();
    placed.cells = &body, placed.object = object;
    if (moves) {
      placed.first_primitive = scene_.objects[object].first_primitive;
      placed.pose = scene_.objects[object].pose;
    }
    bool small = false;
    for (uint32_t own = 0; own < body.size(); ++own) {
      const uint32_t cell = first + own;
      if (!(evaluation.brightness(cell) > 0)) continue;
      if (std::countr_one(covered[cell]) >= int(kPlaces)) continue;
      small |= !body.has_probes(own);
      cells_.push_back({cell, own, number, covered[cell]});
    }
    if (small) sort_small(placed);
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

LitCells::Triangle LitCells::triangle(const Body& body, uint32_t number) const {
  const uint32_t primitive = body.first_primitive + number;
  const scene::Object& object = scene_.objects[scene_.object_of(primitive)];
  const auto& indices = object.triangles[primitive - object.first_primitive];
  const auto corner = [&](size_t k) {
    return Vec3d(object.pose.point(object.vertices[indices[k]]));
  };
  return {corner(0), corner(1) - corner(0), corner(2) - corner(0)};
}

void LitCells::sort_small(Body& body) const {
  body.cells->sort_small(body.triangles, body.begin);
  body.area.resize(body.triangles.size());
  for (size_t own = 0; own + 1 < body.begin.size(); ++own) {
    double sum = 0;
    for (uint32_t k = body.begin[own]; k < body.begin[own + 1]; ++k)
      body.area[k] = sum += length(triangle(body, body.triangles[k]).across());
  }
}

direct::Receiver LitCells::on_small(const Body& body, uint32_t own, uint32_t from) const {
  const uint64_t key = combine(combine(0x706c616365ull, body.first_primitive), own);
  const PathRandom random(key, from);
  const auto begin = body.area.begin() + body.begin[own],
             end = body.area.begin() + body.begin[own + 1];
  const double share = (double(from) + double(random(0, 0))) / kPlaces;
  const auto found = std::upper_bound(begin, end - 1, share * *(end - 1));
  const uint32_t number = body.triangles[size_t(found - body.area.begin())];
  const Triangle chosen = triangle(body, number);
  const double u = std::sqrt(double(random(0, 1))), v = double(random(0, 2));
  const Vec3f p(chosen.corner + chosen.edge_u * (u * (1 - v)) + chosen.edge_v * (u * v));
  Vec3f n(normalize(chosen.across()));
  if (!is_unit(n)) n = {};
  return {p, body.cells->is_back(own) ? -n : n, body.object,
          scene_.slack_of(body.first_primitive + number), combine(key, from)};
}

std::vector<direct::Receiver> lit_places(const LitCells& lit) {
  std::vector<direct::Receiver> out;
  const size_t step = (lit.size() + kPilots - 1) / kPilots;
  for (size_t i = 0; i < lit.size(); i += step)
    if (const direct::Receiver place = lit.place(i, 0); is_unit(place.normal)) out.push_back(place);
  return out;
}

}  // namespace deltalux::gather
