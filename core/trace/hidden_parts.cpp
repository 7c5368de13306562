// SPDX-License-Identifier: Apache-2.0
// A face that many others hide sorts them by squares, so that a ray tests few.
#include "trace/hidden_parts.h"

#include <algorithm>
#include <cmath>

namespace deltalux::trace {
namespace {

constexpr double kInset = 2;  // in units of position_slack(): how near to a border rays may miss
constexpr uint32_t kPerSquare = 4;  // parts, approximately
constexpr uint32_t kMaxSide = 64;

}  // namespace

HiddenParts::HiddenParts(std::span<const scene::Face> faces,
                         const scene::CoincidentFaces& coincident) {
  if (coincident.empty()) return;
  std::vector<Part> parts;
  for (uint32_t i = 0; i < faces.size(); ++i) {
    parts.clear();
    uint32_t last = ~0u;
    for (const auto& hider : coincident.of(i)) {
      if (hider.gap > 0) continue;
      if (hider.face != last) parts.push_back(part_of(faces[i], faces[hider.face]));
      parts.back().from[hider.from_back] = true;
      last = hider.face;
    }
    if (!parts.empty()) add_table(i, parts);
  }
}

HiddenParts::Part HiddenParts::part_of(const scene::Face& hidden, const scene::Face& hider) {
  const Vec3d origin(hidden.corner[0]), u = Vec3d(hidden.corner[1]) - origin,
                                        v = Vec3d(hidden.corner[2]) - origin;
  const Vec3d normal = normalize(cross(u, v));
  Vec3d corner[3];
  double slack = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3d p(hider.corner[k]);
    corner[k] = p - normal * dot(normal, p - origin);
    slack = std::max(slack, double(position_slack(hider.corner[k])));
  }
  const double turn = dot(cross(corner[1] - corner[0], corner[2] - corner[0]), normal) > 0 ? 1 : -1;
  Part part{};
  for (size_t k = 0; k < 3; ++k) {
    const Vec3d from = corner[k], to = corner[(k + 1) % 3];
    const Vec3d inward = normalize(cross(normal, to - from)) * turn;
    part.a[k] = float(dot(inward, u)), part.b[k] = float(dot(inward, v));
    part.c[k] = float(dot(inward, origin - from) - kInset * slack);
  }
  return part;
}

void HiddenParts::add_table(uint32_t face, std::span<const Part> parts) {
  const double wanted = std::sqrt(double(parts.size()) / kPerSquare);
  const auto side = uint32_t(std::clamp(std::ceil(wanted), 1.0, double(kMaxSide)));
  tables_.push_back({face, uint32_t(begin_.size()), side});
  for (uint32_t square = 0; square < side * side; ++square) {
    begin_.push_back(uint32_t(parts_.size()));
    const float low[2] = {float(square % side) / float(side), float(square / side) / float(side)};
    const float wide = 1 / float(side);
    for (const Part& part : parts) {
      bool meets = true;
      for (size_t k = 0; k < 3; ++k) {
        const float u = part.a[k] > 0 ? low[0] + wide : low[0];
        const float v = part.b[k] > 0 ? low[1] + wide : low[1];
        meets &= part.a[k] * u + part.b[k] * v + part.c[k] >= 0;
      }
      if (meets) parts_.push_back(part);
    }
  }
  begin_.push_back(uint32_t(parts_.size()));
}

bool HiddenParts::hides(uint32_t i, float u, float v, bool from_back) const {
  const Table& table = tables_[i];
  const auto at = [&](float x) {
    return uint32_t(std::clamp(x * float(table.side), 0.0f, float(table.side - 1)));
  };
  const uint32_t square = table.first + at(v) * table.side + at(u);
  for (uint32_t k = begin_[square]; k < begin_[square + 1]; ++k) {
    const Part& part = parts_[k];
    if (!part.from[from_back]) continue;
    bool inside = true;
    for (size_t n = 0; n < 3; ++n) inside &= part.a[n] * u + part.b[n] * v + part.c[n] >= 0;
    if (inside) return true;
  }
  return false;
}

}  // namespace deltalux::trace
