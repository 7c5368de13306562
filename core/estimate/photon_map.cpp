// SPDX-License-Identifier: Apache-2.0
// The only file that uses nanoflann. The tree holds the hits; the ellipsoid lies inside the sphere
// that the tree searches, so its distance sorts what the tree finds.
#include "estimate/photon_map.h"

#include <algorithm>
#include <nanoflann.hpp>

#include "base/error.h"
#include "estimate/disc_moments.h"

namespace deltalux::estimate {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSameSurface = 0.70710678118654752;  // cos 45 degrees
constexpr size_t kGrain = 64;

#if NANOFLANN_VERSION >= 0x150
using SearchParameters = nanoflann::SearchParameters;
#else
using SearchParameters = nanoflann::SearchParams;
#endif

/// The hits as nanoflann reads them. Its build cannot be asked to stop, but every point it reads
/// comes from here.
struct Hits {
  std::vector<Vec3d> position;
  std::vector<uint32_t> segment;
  std::vector<Vec3d> normal;  ///< of the surface hit, where surfaces are known
  const Progress* building = nullptr;
  mutable uint32_t reads = 0;

  size_t kdtree_get_point_count() const { return position.size(); }
  double kdtree_get_pt(size_t i, size_t axis) const {
    if (building && (++reads & 0xffff) == 0) building->check();
    return position[i][int(axis)];
  }
  template <class Bounds>
  bool kdtree_get_bbox(Bounds&) const {
    return false;
  }
};

using Metric = nanoflann::L2_Simple_Adaptor<double, Hits, double, uint32_t>;
using Tree = nanoflann::KDTreeSingleIndexAdaptor<Metric, Hits, 3, uint32_t>;

struct Found {
  double distance2;
  uint32_t segment;
};

/// A total order of photons that does not know their numbers, so that segments may come in any
/// order. Photons that are equal in it are interchangeable.
bool before(const segments::SegmentSpan& s, const Found& a, const Found& b) {
  if (a.distance2 != b.distance2) return a.distance2 < b.distance2;
  const size_t i = a.segment, j = b.segment;
  for (int c = 0; c < 3; ++c)
    if (s.power[3 * i + c] != s.power[3 * j + c]) return s.power[3 * i + c] < s.power[3 * j + c];
  for (const float* column : {s.dx, s.dy, s.dz, s.ox, s.oy, s.oz, s.length})
    if (column[i] != column[j]) return column[i] < column[j];
  return false;
}

/// What nanoflann calls a result set: keeps the nearest photons that arrive from the front.
class Nearest {
 public:
  using DistanceType = double;

  Nearest(const segments::SegmentSpan& segments, const Hits& hits, Vec3d point, Vec3d normal,
          double stretch, size_t k, double reach2)
      : segments_(segments),
        hits_(hits),
        point_(point),
        normal_(normal),
        stretch_(stretch),
        k_(k),
        reach2_(reach2) {}

  bool addPoint(double, uint32_t hit) {
    ++tests;
    const uint32_t s = hits_.segment[hit];
    const double facing = normal_.x * double(segments_.dx[s]) +
                          normal_.y * double(segments_.dy[s]) + normal_.z * double(segments_.dz[s]);
    if (!(facing < 0)) return true;
    if (!hits_.normal.empty() && !(dot(hits_.normal[hit], normal_) > kSameSurface)) return true;
    const Vec3d gap = hits_.position[hit] - point_;
    const double height = dot(gap, normal_);
    const Found found{dot(gap, gap) + stretch_ * (height * height), s};
    if (!(found.distance2 < reach2_)) return true;
    const auto less = [&](const Found& a, const Found& b) { return before(segments_, a, b); };
    if (heap.size() == k_) {
      if (!less(found, heap.front())) return true;
      std::pop_heap(heap.begin(), heap.end(), less);
      heap.pop_back();
    }
    heap.push_back(found);
    std::push_heap(heap.begin(), heap.end(), less);
    return true;
  }
  /// A little too far: photons as far as the farthest one have to arrive here, to be compared.
  double worstDist() const {
    const double worst = heap.size() == k_ ? heap.front().distance2 : reach2_;
    return worst * (1 + 1e-9) + std::numeric_limits<double>::min();
  }
  bool full() const { return heap.size() == k_; }
  size_t size() const { return heap.size(); }

  std::vector<Found> heap;
  uint64_t tests = 0;

 private:
  const segments::SegmentSpan& segments_;
  const Hits& hits_;
  Vec3d point_, normal_;
  double stretch_;
  size_t k_;
  double reach2_;
};

}  // namespace

PhotonMap::PhotonMap(std::vector<Vec3d> points, std::vector<Vec3d> normals, const Options& options,
                     std::shared_ptr<const SurfaceTree> surfaces)
    : points_(std::move(points)),
      normals_(std::move(normals)),
      options_(options),
      surfaces_(std::move(surfaces)) {}

Neighbours PhotonMap::neighbours(const segments::SegmentSpan& segments, const Workers& workers,
                                 Progress& progress, const double* reach2) const {
  std::vector<uint32_t> landing;
  if (surfaces_) landing = surfaces_->landings(segments, workers, progress);
  Hits hits;
  for (size_t i = 0; i < segments.count; ++i) {
    if (!std::isfinite(segments.length[i])) continue;
    if (surfaces_ && landing[i] == kNoTriangle) continue;
    hits.position.push_back(end_of(segments, i));
    hits.segment.push_back(uint32_t(i));
    if (surfaces_) hits.normal.push_back(surfaces_->triangles()[landing[i]].normal);
  }
  progress.begin("photon map", 1);
  hits.building = &progress;
  const Tree tree(3, hits);
  hits.building = nullptr;

  const size_t count = points_.size();
  std::vector<std::vector<Found>> found(count);
  progress.begin("gather", count);
  workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      progress.check();
      const size_t k = reach2 ? hits.position.size() : options_.k;
      const double reach = reach2 ? reach2[i] : std::numeric_limits<double>::infinity();
      Nearest nearest(segments, hits, points_[i], normals_[i],
                      options_.compression * options_.compression - 1, k, reach);
      const double at[3] = {points_[i].x, points_[i].y, points_[i].z};
      if (!hits.position.empty()) tree.findNeighbors(nearest, at, SearchParameters());
      std::sort(nearest.heap.begin(), nearest.heap.end(),
                [&](const Found& a, const Found& b) { return before(segments, a, b); });
      found[i] = std::move(nearest.heap);
    }
    progress.advance(end - begin);
  });

  Neighbours out;
  out.start.push_back(0);
  for (size_t i = 0; i < count; ++i) {
    auto& list = found[i];
    out.radius2.push_back(reach2 ? reach2[i] : list.empty() ? 0.0 : list.back().distance2);
    out.rim.push_back(list.empty() ? kNoTriangle : list.back().segment);
    if (!reach2 && options_.unbiased && !list.empty()) list.pop_back();
    for (const Found& f : list)
      out.photon.push_back(f.segment), out.distance2.push_back(f.distance2);
    out.start.push_back(out.photon.size());
    list = {};
  }
  return out;
}

/// Of a photon at the centre: 1.
double PhotonMap::weight(double distance2, double radius2) const {
  switch (options_.kernel) {
    case Kernel::constant:
      return 1;
    case Kernel::cone:
      return 1 - std::sqrt(distance2 / radius2) / options_.cone;
    case Kernel::epanechnikov:
      return 1 - distance2 / radius2;
  }
  return 0;
}

/// Integral of weight() over the surfaces inside the region.
double PhotonMap::kernel_integral(size_t sample, double radius2) const {
  const double cone = options_.cone, radius = std::sqrt(radius2);
  if (!surfaces_) {
    const double disc = kPi * radius2;
    if (options_.kernel == Kernel::cone) return disc * (1 - 2 / (3 * cone));
    return options_.kernel == Kernel::epanechnikov ? disc / 2 : disc;
  }
  if (options_.kernel == Kernel::constant) return area_within(sample, radius);
  // By layers: the integral of w(t) dA(t) is w(1) A(1) - the integral of w'(t) A(t).
  constexpr double kAt[4] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674,
                             0.96028985649753623};
  constexpr double kShare[4] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447,
                                0.10122853629037626};
  const bool is_cone = options_.kernel == Kernel::cone;
  double sum = is_cone ? (1 - 1 / cone) * area_within(sample, radius) : 0;
  for (int i = 0; i < 8; ++i) {
    const double t = (1 + (i % 2 ? kAt[i / 2] : -kAt[i / 2])) / 2;
    const double slope = is_cone ? 1 / cone : 2 * t;
    sum += kShare[i / 2] / 2 * slope * area_within(sample, t * radius);
  }
  return sum;
}

/// Area of the surfaces inside the region that are turned less than 45 degrees from the sample's
/// plane, exact: where the normal's axis is stretched the region is a sphere, which cuts each
/// triangle's plane in a circle; areas within one plane keep their ratios.
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

Gathered PhotonMap::weigh(const segments::SegmentSpan& segments, const Neighbours& neighbours,
                          const Workers& workers, Progress& progress) const {
  const size_t count = points_.size();
  Gathered out;
  out.irradiance.assign(3 * count, 0.0);
  out.stats.hits = neighbours.photon.size();
  progress.begin("estimate", count);
  workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      progress.check();
      const double radius2 = neighbours.radius2[i];
      const uint64_t first = neighbours.start[i], last = neighbours.start[i + 1];
      const double integral = radius2 > 0 && first < last ? kernel_integral(i, radius2) : 0;
      if (!(integral > 0)) continue;
      double sum[3] = {};
      // Whole numbers below 2^53 add exactly under the constant kernel, in any order.
      for (uint64_t j = first; j < last; ++j) {
        const double w = weight(neighbours.distance2[j], radius2);
        const uint32_t* power = segments.power + 3 * size_t(neighbours.photon[j]);
        for (int c = 0; c < 3; ++c) sum[c] += w * double(power[c]);
      }
      for (int c = 0; c < 3; ++c) out.irradiance[3 * i + c] = sum[c] / integral;
    }
    progress.advance(end - begin);
  });
  return out;
}

Gathered PhotonMap::estimate(const segments::SegmentSpan& segments, const Workers& workers,
                             Progress* progress) const {
  Progress unwatched;
  Progress& watched = progress ? *progress : unwatched;
  return weigh(segments, neighbours(segments, workers, watched), workers, watched);
}

}  // namespace deltalux::estimate
