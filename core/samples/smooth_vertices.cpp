// SPDX-License-Identifier: Apache-2.0
// Sums over the corners of each vertex, in the order of corners.
#include "samples/smooth_vertices.h"

#include <algorithm>
#include <cmath>

#include "samples/components.h"
#include "samples/triangle_shapes.h"

namespace deltalux::samples {
namespace {

struct Face {
  Vec3d normal;
  double height;  ///< the smallest of the three
  std::array<double, 3> angle;
  std::array<Vec3d, 3> bisector;
};

size_t next(size_t corner) { return corner - corner % 3 + (corner + 1) % 3; }
size_t previous(size_t corner) { return corner - corner % 3 + (corner + 2) % 3; }
Vec3d over(Vec3d v, double length) { return {v.x / length, v.y / length, v.z / length}; }

Face face_of(std::span<const Vec3d> points, const Triangle& triangle) {
  std::array<Vec3d, 3> ahead;
  std::array<double, 3> size;
  for (size_t k = 0; k < 3; ++k) {
    ahead[k] = points[size_t(triangle[(k + 1) % 3])] - points[size_t(triangle[k])];
    size[k] = length(ahead[k]);
  }
  Face face;
  const Vec3d normal = cross(ahead[0], ahead[1]);
  const double doubled_area = length(normal);
  face.normal = over(normal, doubled_area);
  face.height = doubled_area / std::max({size[0], size[1], size[2]});
  for (size_t k = 0; k < 3; ++k) ahead[k] = over(ahead[k], size[k]);
  for (size_t k = 0; k < 3; ++k) {
    const Vec3d behind = -ahead[(k + 2) % 3];
    face.angle[k] = std::acos(std::clamp(inner(ahead[k], behind), -1.0, 1.0));
    const Vec3d middle = ahead[k] + behind;
    face.bisector[k] = over(middle, std::max(length(middle), 1e-12));
  }
  return face;
}

class Smoothing {
 public:
  explicit Smoothing(const ShadedMesh& mesh)
      : mesh_(mesh), faces_(mesh.triangles.size()), joined_(3 * mesh.triangles.size()) {
    for (size_t t = 0; t < faces_.size(); ++t) faces_[t] = face_of(mesh.points, mesh.triangles[t]);
  }

  /// Returns the vertex number of each corner.
  std::vector<int32_t> group() {
    const auto [one, two] = shared_edges(mesh_.triangles, mesh_.points.size());
    Components vertices(joined_.size());
    for (size_t i = 0; i < one.size(); ++i) {
      const size_t a = size_t(one[i]), b = size_t(two[i]);
      const bool smooth =
          inner(faces_[a / 3].normal, faces_[b / 3].normal) >= mesh_.cosine[a / 3] &&
          !mesh_.parted[a] && !mesh_.parted[b];
      if (!smooth) continue;
      joined_[a] = joined_[b] = 1;
      vertices.join(a, next(b));
      vertices.join(next(a), b);
    }
    return std::move(vertices).numbers();
  }

  void set_normals(SmoothVertices& out) const {
    out.normal.assign(out.corner.size(), {});
    for (size_t c = 0; c < out.of_corner.size(); ++c) {
      Vec3d& sum = out.normal[size_t(out.of_corner[c])];
      sum = sum + faces_[c / 3].normal * faces_[c / 3].angle[c % 3];
    }
    for (size_t v = 0; v < out.normal.size(); ++v) {
      const double size = length(out.normal[v]);
      out.normal[v] =
          size > 1e-9 ? over(out.normal[v], size) : faces_[size_t(out.corner[v]) / 3].normal;
    }
  }

  void set_insets(SmoothVertices& out, double farthest, double share) const {
    const size_t corners = out.of_corner.size(), vertices = out.corner.size();
    std::vector<uint8_t> incomplete(vertices), leads(vertices);
    for (size_t c = 0; c < corners; ++c) {
      const size_t v = size_t(out.of_corner[c]);
      leads[v] |= led(c);
      incomplete[v] |= led(c) || !(joined_[c] && joined_[previous(c)]);
    }
    const auto counts = [&](size_t c) { return led(c) || !leads[size_t(out.of_corner[c])]; };
    // Integral of directions over a corner's sector: its bisector times 2 sin(angle / 2). Summed
    // over a planar fan, it bisects the whole fan, also if that is reflex.
    out.inset.assign(vertices, {});
    std::vector<double> height(vertices, std::numeric_limits<double>::infinity());
    for (size_t c = 0; c < corners; ++c) {
      const size_t v = size_t(out.of_corner[c]);
      if (!incomplete[v]) continue;
      height[v] = std::min(height[v], faces_[c / 3].height);
      if (counts(c)) out.inset[v] = out.inset[v] + bisector(c) * (2 * std::sin(angle(c) / 2));
    }
    // Stay on the surface: choose the face whose bisector is closest to that direction, and move
    // within it.
    std::vector<double> most(vertices, -std::numeric_limits<double>::infinity());
    std::vector<size_t> chosen(vertices);
    for (size_t c = 0; c < corners; ++c) {
      const size_t v = size_t(out.of_corner[c]);
      if (!incomplete[v] || !counts(c)) continue;
      const double looks = inner(bisector(c), out.inset[v]);
      if (looks < most[v]) continue;
      most[v] = looks;
      chosen[v] = c;
    }
    for (size_t v = 0; v < vertices; ++v) {
      if (!incomplete[v]) continue;
      const Vec3d normal = faces_[chosen[v] / 3].normal, own = bisector(chosen[v]);
      Vec3d inward = out.inset[v] - normal * inner(out.inset[v], normal);
      const double size = length(inward);
      inward = over(inward, std::max(size, 1e-12));
      const bool inside = inner(inward, own) >= std::cos(angle(chosen[v]) / 2);
      if (size < 1e-6 || !inside) inward = own;
      out.inset[v] = inward * std::min(farthest, share * height[v]);
    }
  }

 private:
  double angle(size_t corner) const { return faces_[corner / 3].angle[corner % 3]; }
  Vec3d bisector(size_t corner) const { return faces_[corner / 3].bisector[corner % 3]; }
  /// Whether the corner's vertex has to move to this side of something that covers the surface.
  bool led(size_t corner) const { return mesh_.beside[corner] || mesh_.beside[previous(corner)]; }

  const ShadedMesh& mesh_;
  std::vector<Face> faces_;
  std::vector<uint8_t> joined_;  // edges across which the surface continues smoothly
};

}  // namespace

std::optional<SmoothVertices> smooth_vertices(const ShadedMesh& mesh, double farthest, double share,
                                              size_t most) {
  Smoothing smoothing(mesh);
  SmoothVertices out;
  const std::vector<int32_t> of_corner = smoothing.group();
  out.of_corner.assign(of_corner.begin(), of_corner.end());
  size_t count = 0;
  for (int64_t vertex : out.of_corner) count = std::max(count, size_t(vertex) + 1);
  if (count > most) return {};
  out.corner.resize(count);
  for (size_t c = 0; c < out.of_corner.size(); ++c)
    out.corner[size_t(out.of_corner[c])] = int64_t(c);
  smoothing.set_normals(out);
  smoothing.set_insets(out, farthest, share);
  return out;
}

}  // namespace deltalux::samples
