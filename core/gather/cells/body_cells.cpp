// SPDX-License-Identifier: Apache-2.0
// Finds the cell that a point lies in.
#include "gather/cells/body_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gather/cells/cell_builder.h"

namespace deltalux::gather {

BodyCells::BodyCells(std::span<const Triangle> triangles, float edge,
                     const scene::CoincidentFaces& coincident, const Distance& distance,
                     const Progress& progress)
    : rise_(kRise * edge) {
  CellBuilder(triangles, edge, coincident, distance, progress).build(*this);
}

uint32_t BodyCells::square_at(const Patch& patch, uint32_t column, uint32_t row) const {
  if (column >= patch.columns || row >= patch.rows) return kNoCell;
  const uint64_t key = uint64_t(row) * patch.columns + column;
  if (!patch.count) return table_[patch.first + key];
  const auto begin = keys_.begin() + long(patch.first), end = begin + patch.count;
  const auto found = std::lower_bound(begin, end, std::pair{key, uint32_t(0)});
  return found != end && found->first == key ? found->second : kNoCell;
}

uint32_t BodyCells::find(uint32_t triangle, Vec3f p, Vec3f w, float t, float nudge) const {
  const Face& face = faces_[triangle];
  const uint32_t back = dot(face.normal, w) > 0;
  if (face.patch == kNoCell)
    return face.clump == kNoCell ? kNoCell : find_in_clump(face, p, w, t, nudge);
  const Patch& patch = patches_[face.patch];
  const Vec3f d = p - patch.origin;
  const float along = dot(w, patch.u), aside = dot(w, patch.v);
  const float flat = std::sqrt(along * along + aside * aside);
  const float step = flat > 0 ? std::min(nudge / flat, 0.5f * t) : 0.0f;
  const float x = dot(d, patch.u) - step * along, y = dot(d, patch.v) - step * aside;
  const auto place = [](float at, uint32_t count) {
    return uint32_t(std::clamp(at, 0.0f, float(count - 1)));
  };
  const uint32_t column = place(x * patch.columns_per_metre, patch.columns);
  const uint32_t row = place(y * patch.rows_per_metre, patch.rows);
  uint32_t square = square_at(patch, column, row);
  // Rounding may move the point slightly off the triangle's border: try the neighbouring squares.
  for (uint32_t k = 0; square == kNoCell && k < 9; ++k)
    square = square_at(patch, column + k % 3 - 1, row + k / 3 - 1);
  if (square == kNoCell) return kNoCell;
  const Side& side = squares_[square].side[back];
  uint32_t part = 0;
  for (uint32_t k = 0; k < side.lines; ++k) {
    const Line& line = lines_[side.first_line + k];
    part |= uint32_t(line.a * x + line.b * y > line.c) << k;
  }
  return cell_of(side, part);
}

uint32_t BodyCells::find_in_clump(const Face& face, Vec3f p, Vec3f w, float t, float nudge) const {
  const float height = dot(face.normal, w);
  const Side& side = clumps_[face.clump].side[height > 0];
  if (!side.lines) return cell_of(side, 0);
  const Vec3f along = w - face.normal * height;
  const float flat = length(along);
  if (flat > 0) p = p - along * std::min(nudge / flat, 0.5f * t);
  uint32_t part = 0;
  for (uint32_t k = 0; k < side.lines; ++k) {
    const Plane& plane = planes_[side.first_line + k];
    part |= uint32_t(dot(plane.normal, p) > plane.offset) << k;
  }
  return cell_of(side, part);
}

Vec3f BodyCells::probe(uint32_t cell, uint32_t number) const {
  const Spot& spot = spot_[cell];
  const Patch& patch = patches_[spot.patch];
  float at[2];
  for (uint32_t axis = 0; axis < 2; ++axis)
    at[axis] = spot.low[axis] + (spot.high[axis] - spot.low[axis]) *
                                    ((float(spot.probe[2 * number + axis]) + 0.5f) / 256);
  return patch.origin + patch.u * at[0] + patch.v * at[1];
}

void BodyCells::sort_small(std::vector<uint32_t>& triangles, std::vector<uint32_t>& begin) const {
  begin.assign(size() + 1, 0);
  const auto each = [&](const auto& visit) {
    for (uint32_t t = 0; t < faces_.size(); ++t) {
      if (faces_[t].patch != kNoCell || faces_[t].clump == kNoCell) continue;
      for (const Side& side : clumps_[faces_[t].clump].side)
        if (!side.lines && side.largest != kNoCell) visit(t, side.largest);
    }
    for (const auto& [cell, t] : cut_triangles_) visit(t, cell);
  };
  each([&](uint32_t, uint32_t cell) { ++begin[cell + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  triangles.resize(begin.back());
  std::vector<uint32_t> next(begin.begin(), begin.end() - 1);
  each([&](uint32_t t, uint32_t cell) { triangles[next[cell]++] = t; });
}

Vec3f BodyCells::normal(uint32_t cell) const {
  const Spot& spot = spot_[cell];
  const Patch& patch = patches_[spot.patch];
  const Vec3f n = cross(patch.u, patch.v);
  return spot.back ? -n : n;
}

BodyCells::Ball BodyCells::ball(uint32_t cell) const {
  // a point may lie slightly outside of the square that it is assigned to
  constexpr float kRounding = 1.01f;
  const Spot& spot = spot_[cell];
  if (spot.patch == kNoCell)
    return {spot.box.centre(), 0.5f * kRounding * spot.box.diagonal() + rise_};
  const Patch& patch = patches_[spot.patch];
  const float half[2] = {0.5f * (spot.high[0] - spot.low[0]), 0.5f * (spot.high[1] - spot.low[1])};
  return {patch.origin + patch.u * (spot.low[0] + half[0]) + patch.v * (spot.low[1] + half[1]),
          kRounding * std::sqrt(half[0] * half[0] + half[1] * half[1]) + rise_};
}

size_t BodyCells::bytes() const {
  return faces_.capacity() * sizeof(Face) + patches_.capacity() * sizeof(Patch) +
         table_.capacity() * sizeof(uint32_t) + keys_.capacity() * sizeof(keys_[0]) +
         (squares_.capacity() + clumps_.capacity()) * sizeof(Square) +
         lines_.capacity() * sizeof(Line) + planes_.capacity() * sizeof(Plane) +
         cut_triangles_.capacity() * sizeof(cut_triangles_[0]) +
         parts_.capacity() * sizeof(uint32_t) + area_.capacity() * sizeof(float) +
         material_.capacity() * sizeof(uint32_t) + spot_.capacity() * sizeof(Spot);
}

}  // namespace deltalux::gather
