// SPDX-License-Identifier: Apache-2.0
// The only file that uses nanoflann. The kd-tree contains the hits. It searches spheres; the
// ellipsoid lies inside, and its distance sorts the hits found.
#include "estimate/photon_map/photon_map.h"

#include <algorithm>
#include <nanoflann.hpp>

#include "base/error.h"

namespace deltalux::estimate {
namespace {

constexpr size_t kGrain = 64;

#if NANOFLANN_VERSION >= 0x150
using SearchParameters = nanoflann::SearchParameters;
#else
using SearchParameters = nanoflann::SearchParams;
#endif

/// The hits, as nanoflann reads them. Its build cannot be interrupted, but it reads every point
/// from here, where cancellation is checked.
struct Hits {
  std::vector<Vec3d> position;
  std::vector<uint32_t> segment;
  std::vector<Vec3d> normal;  ///< of the surface hit; empty if surfaces do not matter
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

/// Photons on surfaces with similar normals. If surfaces matter, a sample in a dark place would
/// otherwise examine all photons of the brighter walls around it: 6 times slower in an office.
struct Bundle {
  Hits hits;
  Vec3d axis{};       ///< mean of the normals
  double spread = 0;  ///< largest angle between the axis and one of the normals
  std::unique_ptr<Tree> tree;

  void build(const Progress& progress) {
    for (const Vec3d& n : hits.normal) axis = axis + n;
    if (!hits.normal.empty()) axis = normalize(axis);
    for (const Vec3d& n : hits.normal)
      spread = std::max(spread, std::acos(std::clamp(dot(axis, n), -1.0, 1.0)));
    hits.building = &progress;
    tree = std::make_unique<Tree>(3, hits);
    hits.building = nullptr;
  }
  bool may_face(Vec3d normal) const {
    constexpr double kTurn = 0.78539816339744831 + 1e-6;  // 45 degrees, plus a margin for rounding
    return hits.normal.empty() || dot(axis, normal) > std::cos(spread + kTurn);
  }
};

/// The bundle of a direction: nine on each side of a cube.
size_t bundle_of(Vec3d n) {
  const double x = std::fabs(n.x), y = std::fabs(n.y), z = std::fabs(n.z);
  const int major = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const double size = std::max({x, y, z});
  const auto third = [&](double value) { return std::min(2, int((value / size + 1) * 1.5)); };
  const int side = 2 * major + (n[major] < 0);
  return size_t((side * 3 + third(n[(major + 1) % 3])) * 3 + third(n[(major + 2) % 3]));
}

struct Neighbour {
  double distance2;
  uint32_t segment;
};

/// A total order of photons that does not depend on their indices, so that segments may come in any
/// order. Photons that compare equal are interchangeable.
bool before(const segments::SegmentSpan& s, const Neighbour& a, const Neighbour& b) {
  if (a.distance2 != b.distance2) return a.distance2 < b.distance2;
  const size_t i = a.segment, j = b.segment;
  for (int c = 0; c < 3; ++c)
    if (s.power[3 * i + c] != s.power[3 * j + c]) return s.power[3 * i + c] < s.power[3 * j + c];
  for (const float* column : {s.dx, s.dy, s.dz, s.ox, s.oy, s.oz, s.length})
    if (column[i] != column[j]) return column[i] < column[j];
  return false;
}

/// A result set for nanoflann: keeps the nearest photons that arrive from the front.
class Nearest {
 public:
  using DistanceType = double;

  Nearest(const segments::SegmentSpan& segments, Vec3d point, Vec3d normal, double stretch,
          size_t k, double reach2)
      : segments_(segments),
        point_(point),
        normal_(normal),
        stretch_(stretch),
        k_(k),
        reach2_(reach2) {}

  void look_in(const Bundle& bundle) {
    hits_ = &bundle.hits;
    const double at[3] = {point_.x, point_.y, point_.z};
    bundle.tree->findNeighbors(*this, at, SearchParameters());
  }

  bool addPoint(double, uint32_t hit) {
    ++tests;
    const uint32_t s = hits_->segment[hit];
    const double facing = normal_.x * double(segments_.dx[s]) +
                          normal_.y * double(segments_.dy[s]) + normal_.z * double(segments_.dz[s]);
    if (!(facing < 0)) return true;
    if (!hits_->normal.empty() && !(dot(hits_->normal[hit], normal_) > kSameSurface)) return true;
    const Vec3d gap = hits_->position[hit] - point_;
    const double height = dot(gap, normal_);
    const Neighbour found{dot(gap, gap) + stretch_ * (height * height), s};
    if (!(found.distance2 < reach2_)) return true;
    const auto less = [&](const Neighbour& a, const Neighbour& b) {
      return before(segments_, a, b);
    };
    if (heap.size() == k_) {
      if (!less(found, heap.front())) return true;
      std::pop_heap(heap.begin(), heap.end(), less);
      heap.pop_back();
    }
    heap.push_back(found);
    std::push_heap(heap.begin(), heap.end(), less);
    return true;
  }
  /// Slightly too large: photons as far away as the farthest one must get here to be compared.
  double worstDist() const {
    const double worst = heap.size() == k_ ? heap.front().distance2 : reach2_;
    return worst * (1 + 1e-9) + std::numeric_limits<double>::min();
  }
  bool full() const { return heap.size() == k_; }
  void sort() const {}  // required by nanoflann 1.6 and later; the heap is ordered as it is filled
  size_t size() const { return heap.size(); }

  std::vector<Neighbour> heap;
  uint64_t tests = 0;

 private:
  const segments::SegmentSpan& segments_;
  const Hits* hits_ = nullptr;
  Vec3d point_, normal_;
  double stretch_;
  size_t k_;
  double reach2_;
};

/// The photons of all segments that end, in bundles; in a single bundle if `surfaces` is null.
std::vector<std::unique_ptr<Bundle>> bundled(const segments::SegmentSpan& segments,
                                             const SurfaceTree* surfaces, const Workers& workers,
                                             Progress& progress) {
  std::vector<uint32_t> landing;
  if (surfaces) landing = surfaces->landings(segments, workers, progress);
  std::vector<std::unique_ptr<Bundle>> bundles(surfaces ? 54 : 1);
  for (size_t i = 0; i < segments.count; ++i) {
    if ((i & 0xffff) == 0) progress.check();
    if (!std::isfinite(segments.length[i])) continue;
    if (surfaces && landing[i] == kNoTriangle) continue;
    const Vec3d normal = surfaces ? surfaces->triangles()[landing[i]].normal : Vec3d{};
    auto& bundle = bundles[surfaces ? bundle_of(normal) : 0];
    if (!bundle) bundle = std::make_unique<Bundle>();
    bundle->hits.position.push_back(end_of(segments, i));
    bundle->hits.segment.push_back(uint32_t(i));
    if (surfaces) bundle->hits.normal.push_back(normal);
  }
  std::erase(bundles, nullptr);
  progress.begin("photon map", bundles.size());
  for (const auto& bundle : bundles) {
    bundle->build(progress);
    progress.advance(1);
  }
  return bundles;
}

}  // namespace

PhotonMap::PhotonMap(std::vector<Vec3d> points, std::vector<Vec3d> normals, const Options& options,
                     std::shared_ptr<const SurfaceTree> surfaces)
    : points_(std::move(points)),
      normals_(std::move(normals)),
      options_(options),
      surfaces_(std::move(surfaces)) {}

Neighbours PhotonMap::neighbours(const segments::SegmentSpan& segments, const Workers& workers,
                                 Progress& progress, const double* reach2) const {
  const std::vector<std::unique_ptr<Bundle>> bundles =
      bundled(segments, surfaces_.get(), workers, progress);
  size_t photons = 0;
  for (const auto& bundle : bundles) photons += bundle->hits.segment.size();
  const size_t count = points_.size();
  std::vector<std::vector<Neighbour>> found(count);
  std::vector<uint64_t> tests(count);
  progress.begin("gather", count);
  workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      progress.check();
      Nearest nearest(segments, points_[i], normals_[i],
                      options_.compression * options_.compression - 1,
                      reach2 ? photons : options_.k,
                      reach2 ? reach2[i] : std::numeric_limits<double>::infinity());
      std::vector<std::pair<double, const Bundle*>> order;  // most similar normals first
      for (const auto& bundle : bundles)
        if (bundle->may_face(normals_[i]))
          order.emplace_back(-dot(bundle->axis, normals_[i]), bundle.get());
      std::sort(order.begin(), order.end());
      for (const auto& [turned, bundle] : order) nearest.look_in(*bundle);
      std::sort(nearest.heap.begin(), nearest.heap.end(),
                [&](const Neighbour& a, const Neighbour& b) { return before(segments, a, b); });
      found[i] = std::move(nearest.heap);
      tests[i] = nearest.tests;
    }
    progress.advance(end - begin);
  });

  Neighbours out;
  out.start.push_back(0);
  for (size_t i = 0; i < count; ++i) {
    out.tests += tests[i];
    auto& list = found[i];
    out.radius2.push_back(reach2 ? reach2[i] : list.empty() ? 0.0 : list.back().distance2);
    out.rim.push_back(list.empty() ? kNoTriangle : list.back().segment);
    if (!reach2 && options_.unbiased && !list.empty()) list.pop_back();
    for (const Neighbour& f : list)
      out.photon.push_back(f.segment), out.distance2.push_back(f.distance2);
    out.start.push_back(out.photon.size());
    list = {};
  }
  return out;
}

/// The kernel, relative to its value at the centre.
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

Gathered PhotonMap::weigh(const segments::SegmentSpan& segments, const Neighbours& neighbours,
                          const Workers& workers, Progress& progress) const {
  const size_t count = points_.size();
  Gathered out;
  out.irradiance.assign(3 * count, 0.0);
  out.stats.hits = neighbours.photon.size();
  out.stats.disc_tests = neighbours.tests;
  progress.begin("estimate", count);
  workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      progress.check();
      const double radius2 = neighbours.radius2[i];
      const uint64_t first = neighbours.start[i], last = neighbours.start[i + 1];
      const double integral = radius2 > 0 && first < last ? kernel_integral(i, radius2) : 0;
      if (!(integral > 0)) continue;
      double sum[3] = {};
      // With the constant kernel, integers below 2^53 add exactly, in any order.
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
