// SPDX-License-Identifier: Apache-2.0
// The area that a photon map divides by: that of a disc, or of actual surfaces (Hey & Purgathofer
// 2002).
#include "estimate/disc_moments.h"
#include "estimate/photon_map/photon_map.h"

namespace deltalux::estimate {
namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

/// Integral of weight() over the surfaces inside the region.
double PhotonMap::kernel_integral(size_t sample, double radius2) const {
  const double cone = options_.cone, radius = std::sqrt(radius2);
  if (!surfaces_) {
    const double disc = kPi * radius2;
    if (options_.kernel == Kernel::cone) return disc * (1 - 2 / (3 * cone));
    return options_.kernel == Kernel::epanechnikov ? disc / 2 : disc;
  }
  if (options_.kernel == Kernel::constant) return area_within(sample, radius);
  // Integrate by parts: the integral of w(t) dA(t) is w(1) A(1) minus the integral of w'(t) A(t).
  constexpr double kAt[4] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674,
                             0.96028985649753623};
  constexpr double kTint[4] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447,
                               0.10122853629037626};
  const bool is_cone = options_.kernel == Kernel::cone;
  double sum = is_cone ? (1 - 1 / cone) * area_within(sample, radius) : 0;
  for (int i = 0; i < 8; ++i) {
    const double t = (1 + (i % 2 ? kAt[i / 2] : -kAt[i / 2])) / 2;
    const double slope = is_cone ? 1 / cone : 2 * t;
    sum += kTint[i / 2] / 2 * slope * area_within(sample, t * radius);
  }
  return sum;
}

/// Exact area of the surfaces within the region that are tilted by less than 45 degrees from the
/// sample's plane. If the axis along the normal is stretched, the region is a sphere, which cuts
/// the plane of each triangle in a circle; ratios of areas within a plane are preserved.
double PhotonMap::area_within(size_t sample, double radius) const {
  const Vec3d centre = points_[sample], n = normals_[sample];
  Vec3d u, v;
  tangent_frame(n, u, v);
  double area = 0;
  surfaces_->near(centre, radius, [&](uint32_t number) {
    const SurfaceTriangle& triangle = surfaces_->triangles()[number];
    if (!(dot(triangle.normal, n) > kSameSurface)) return;
    Vec3d corner[3];
    for (int k = 0; k < 3; ++k) {
      const Vec3d p = triangle.corner[k] - centre;
      corner[k] = {dot(p, u), dot(p, v), dot(p, n) * options_.compression};
    }
    const auto inside = [&](Vec3d p) { return dot(p, p) < radius * radius; };
    if (inside(corner[0]) && inside(corner[1]) && inside(corner[2])) {
      area +=
          triangle.area;  // most triangles of a large region: the closed form costs 20 times this
      return;
    }
    const Vec3d twice = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const double doubled_area = length(twice);
    const Vec3d normal = twice * (1 / doubled_area);
    const double height = dot(corner[0], normal);
    const double circle2 = radius * radius - height * height;
    if (!(circle2 > 0)) return;
    const double scale = 1 / std::sqrt(circle2);
    Vec3d a, b;
    tangent_frame(normal, a, b);
    DiscMoments moments;
    for (int k = 0; k < 3; ++k) {
      const Vec3d p = corner[k] * scale, q = corner[(k + 1) % 3] * scale;
      moments.add_edge(dot(p, a), dot(p, b), dot(q, a), dot(q, b));
    }
    area += std::max(0.0, moments.area()) * circle2 * (triangle.area / (doubled_area / 2));
  });
  return area;
}

}  // namespace deltalux::estimate
