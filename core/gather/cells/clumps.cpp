// SPDX-License-Identifier: Apache-2.0
// Merges triangles that are too small for squares into clumps, and divides these into cells by the
// planes that stand on them.
#include <algorithm>
#include <cmath>

#include "gather/cells/cell_builder.h"

namespace deltalux::gather {
namespace {

constexpr double kMinPart = 1e-5;  // of a clump: parts with less area are dropped

}  // namespace

void CellBuilder::merge_small(BodyCells& out, const std::vector<uint32_t>& triangles) {
  // Merge by position, dominant direction and material.
  std::map<std::array<int64_t, 5>, uint32_t> found;
  for (uint32_t t : triangles) {
    const Vec3d c = across(t), n = c * (1 / length(c));
    const Vec3d centre = (corner(t, 0) + corner(t, 1) + corner(t, 2)) * (1.0 / 3);
    const int axis = main_axis(n);
    const auto at = [&](double x) { return int64_t(std::floor(x / edge_)); };
    const std::array<int64_t, 5> key{at(centre.x), at(centre.y), at(centre.z),
                                     2 * axis + (n[axis] > 0), int64_t(triangles_[t].material)};
    const auto [entry, fresh] = found.try_emplace(key, uint32_t(clumps_.size()));
    if (fresh) clumps_.emplace_back().material = triangles_[t].material;
    Clump& clump = clumps_[entry->second];
    clump.triangles.push_back(t);
    clump.across = clump.across + c;
    for (const Vec3f& p : triangles_[t].corner) clump.box.grow(p);
    out.faces_[t] = {Vec3f(n), kNoCell, entry->second};
  }
}

uint32_t CellBuilder::add_clump_cell(BodyCells& out, const Clump& clump, bool back) {
  const uint32_t cell = add_cell(out, 0, clump.material);
  out.spot_[cell].back = back;
  out.spot_[cell].box = clump.box;
  return cell;
}

void CellBuilder::make_clump_side(BodyCells& out, BodyCells::Square& own, bool back,
                                  const Clump& clump) {
  const std::vector<PlaneCut>& cuts = clump.cuts[back];
  BodyCells::Side& side = own.side[back];
  side.first_line = uint32_t(out.planes_.size());
  side.lines = uint32_t(cuts.size());
  side.first_part = uint32_t(out.parts_.size());
  for (const PlaneCut& cut : cuts) out.planes_.push_back({Vec3f(cut.normal), float(cut.offset)});
  const size_t count = size_t(1) << cuts.size();
  std::vector<double> area(count), parts(count);
  float whole = 0;
  for (const uint32_t t : clump.triangles) {
    std::fill(parts.begin(), parts.end(), 0);
    add_parts(t, back, cuts, parts);
    for (size_t part = 0; part < count; ++part) area[part] += parts[part];
    whole += float(parts[0]);
  }
  double all = 0, largest = -1;
  for (const double one : area) all += one;
  for (size_t part = 0; part < count; ++part) {
    // What is hidden as a whole has one cell, without area.
    if (!(area[part] > kMinPart * all) && (all > 0 || part > 0)) {
      out.parts_.push_back(kNoCell);
      continue;
    }
    const uint32_t cell = add_clump_cell(out, clump, back);
    out.area_[cell] = cuts.empty() ? whole : float(area[part]);
    if (area[part] > largest) largest = area[part], side.largest = cell;
    out.parts_.push_back(cell);
  }
  if (cuts.empty()) return;
  for (const uint32_t t : clump.triangles) {
    std::fill(parts.begin(), parts.end(), 0);
    add_parts(t, back, cuts, parts);
    for (size_t part = 0; part < count; ++part)
      if (const uint32_t cell = out.parts_[side.first_part + part];
          cell != kNoCell && parts[part] > 0)
        out.cut_triangles_.push_back({cell, t});
  }
}

void CellBuilder::add_parts(uint32_t triangle, bool back, std::span<const PlaneCut> cuts,
                            std::vector<double>& areas) const {
  if (cuts.empty() && coincident_.of(triangle).empty()) {
    areas[0] += 0.5 * length(across(triangle));
    return;
  }
  const Vec3d u = normalize(corner(triangle, 1) - corner(triangle, 0));
  const Frame2 frame{corner(triangle, 0), u, cross(normalize(across(triangle)), u)};
  std::vector<Polygon> seen;
  find_seen(frame, {projected(frame, triangle), triangle}, back, seen);
  for (const Polygon& whole : seen)
    for (size_t part = 0; part < areas.size(); ++part) {
      Polygon piece = whole;
      for (size_t k = 0; k < cuts.size() && piece.size() >= 3; ++k) {
        const double sign = part >> k & 1 ? 1 : -1;
        const PlaneCut& cut = cuts[k];
        const double a = dot(cut.normal, frame[1]), b = dot(cut.normal, frame[2]),
                     c = cut.offset - dot(cut.normal, frame[0]);
        piece = clipped(piece, [&](const Point& p) { return sign * (a * p.x + b * p.y - c); });
      }
      areas[part] += area_of(piece);
    }
}

}  // namespace deltalux::gather
