// SPDX-License-Identifier: Apache-2.0
// Where on a triangle a hit lies is found in double precision, from the hit's point.
#include "trace/mesh_caster.h"

#include <algorithm>

namespace deltalux::trace {

MeshCaster::MeshCaster(std::vector<Vec3f> vertices, std::vector<std::array<uint32_t, 3>> triangles)
    : vertices_(std::move(vertices)),
      triangles_(std::move(triangles)),
      scene_(device_, vertices_, triangles_, nullptr) {}

MeshHit MeshCaster::closest(Vec3f origin, Vec3f direction) const {
  const Hit hit = scene_.closest(0, origin, direction, 0, std::numeric_limits<float>::infinity());
  MeshHit out{hit.t, hit.primitive};
  if (!hit.valid()) return out;
  const auto& t = triangles_[hit.primitive];
  const Vec3d a = Vec3d(vertices_[t[0]]), e = Vec3d(vertices_[t[1]]) - a,
              f = Vec3d(vertices_[t[2]]) - a, q = Vec3d(origin + direction * hit.t) - a,
              n = cross(e, f);
  const double area = dot(n, n);
  out.u = float(std::clamp(dot(cross(q, f), n) / area, 0.0, 1.0));
  out.v = float(std::clamp(dot(cross(e, q), n) / area, 0.0, 1.0 - double(out.u)));
  return out;
}

}  // namespace deltalux::trace
