// SPDX-License-Identifier: Apache-2.0
// Searches hits in a grid per surface; moments of the clipped kernel are computed in closed form.
#include "estimate/local_linear.h"

#include <algorithm>
#include <tuple>

#include "estimate/disc_moments.h"

namespace deltalux::estimate {
namespace {

constexpr double kPi = 3.14159265358979323846;
// smallest cosine between a sample's plane and surfaces of its domain
constexpr double kTurned = 0.6;
// relative to the scene's diagonal: largest distance of a sample from a surface
constexpr double kSampleReach = 0.01;
// The smallest variance of the kernel's domain along a direction, in squared bandwidths, for which
// a slope is fitted: a strip a tenth of a bandwidth wide. Across narrower strips the fit is
// constant.
constexpr double kMinVariance = 1e-3;
constexpr size_t kGrain = 64;

/// Weights for the part of the kernel's disc that is surface: K(u) (level + slope . u) integrates
/// to 1, and its product with u to 0.
struct Fit {
  double level = 0, slope_u = 0, slope_v = 0;
};

Fit fit(const double a[6]) {
  Fit f;
  if (!(a[0] > 1e-9)) return f;
  const double mu = a[1] / a[0], mv = a[2] / a[0];
  const double uu = a[3] / a[0] - mu * mu, uv = a[4] / a[0] - mu * mv, vv = a[5] / a[0] - mv * mv;
  // The principal axes of the domain.
  const double angle = 0.5 * std::atan2(2 * uv, uu - vv);
  const double c = std::cos(angle), s = std::sin(angle);
  const double variance[2] = {c * c * uu + 2 * c * s * uv + s * s * vv,
                              s * s * uu - 2 * c * s * uv + c * c * vv};
  const double axis[2][2] = {{c, s}, {-s, c}};
  f.level = 1;
  for (int k = 0; k < 2; ++k) {
    if (!(variance[k] > kMinVariance)) continue;
    const double along = axis[k][0] * mu + axis[k][1] * mv, slope = along / variance[k];
    f.level += slope * along;
    f.slope_u -= slope * axis[k][0], f.slope_v -= slope * axis[k][1];
  }
  f.level /= a[0], f.slope_u /= a[0], f.slope_v /= a[0];
  return f;
}

}  // namespace

struct LocalLinear::Hit {
  Vec3d position;
  uint32_t power[3], triangle;
};

struct LocalLinear::Cell {
  uint32_t surface;
  int32_t z, y, x;
  auto operator<=>(const Cell&) const = default;
};

/// Hits sorted by cells as wide as their surface's kernel, in an order that is independent of the
/// order of segments.
class LocalLinear::Grid {
 public:
  Grid(std::vector<Hit> hits, const SurfaceTree& surfaces, const std::vector<double>& bandwidth,
       const Workers& workers, Progress& progress)
      : hits_(hits.size()), cells_(hits.size()) {
    std::vector<std::pair<Cell, uint32_t>> order(hits.size());
    workers.for_blocks(hits.size(), 4096, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const uint32_t surface = surfaces.triangles()[hits[i].triangle].surface;
        order[i] = {cell(hits[i].position, surface, bandwidth[surface]), uint32_t(i)};
      }
    });
    uint32_t compared = 0;
    const auto content = [](const Hit& h) {
      return std::tie(h.position.x, h.position.y, h.position.z, h.power[0], h.power[1], h.power[2],
                      h.triangle);
    };
    std::sort(order.begin(), order.end(), [&](const auto& a, const auto& b) {
      if ((++compared & 0xffff) == 0) progress.check();
      if (a.first != b.first) return a.first < b.first;
      return content(hits[a.second]) < content(hits[b.second]);
    });
    for (size_t i = 0; i < order.size(); ++i)
      cells_[i] = order[i].first, hits_[i] = hits[order[i].second];
  }

  static Cell cell(Vec3d p, uint32_t surface, double width) {
    const auto number = [&](double x) {
      return int32_t(std::clamp(std::floor(x / width), -1e9, 1e9));
    };
    return {surface, number(p.z), number(p.y), number(p.x)};
  }

  template <class Visit>
  void around(Vec3d p, uint32_t surface, double width, int32_t cells, Visit&& visit) const {
    const Cell middle = cell(p, surface, width);
    for (int32_t z = -cells; z <= cells; ++z)
      for (int32_t y = -cells; y <= cells; ++y) {
        const Cell first{surface, middle.z + z, middle.y + y, middle.x - cells};
        Cell last = first;
        last.x = middle.x + cells;
        auto at = std::lower_bound(cells_.begin(), cells_.end(), first);
        for (; at != cells_.end() && *at <= last; ++at) visit(hits_[size_t(at - cells_.begin())]);
      }
  }

 private:
  std::vector<Hit> hits_;
  std::vector<Cell> cells_;
};

LocalLinear::LocalLinear(std::vector<Vec3d> points, std::vector<Vec3d> normals,
                         const Options& options, std::shared_ptr<const SurfaceTree> surfaces)
    : points_(std::move(points)),
      normals_(std::move(normals)),
      options_(options),
      surfaces_(std::move(surfaces)) {}

std::vector<double> LocalLinear::bandwidths(const std::vector<uint64_t>& hits) const {
  std::vector<double> area(surfaces_->surfaces(), 0.0), out(area.size(), 0.0);
  for (const SurfaceTriangle& t : surfaces_->triangles()) area[t.surface] += t.area;
  for (size_t s = 0; s < out.size(); ++s) {
    if (hits[s] == 0) continue;
    out[s] = options_.bandwidth > 0
                 ? options_.bandwidth
                 : std::min(surfaces_->diagonal(),
                            std::sqrt(options_.expected_hits * area[s] / (kPi * double(hits[s]))));
  }
  return out;
}

void LocalLinear::estimate_one(size_t sample, const Grid& grid, uint32_t surface, double bandwidth,
                               std::vector<uint32_t>& domain, double irradiance[3],
                               Stats& stats) const {
  const Vec3d centre = points_[sample], n = normals_[sample];
  Vec3d u, v;
  tangent_frame(n, u, v);
  const double scale = 1 / bandwidth;
  DiscMoments moments;
  domain.clear();
  // A surface tilted by up to acos(kTurned) rises at most 4/3 of the bandwidth within the disc.
  surfaces_->near(centre, 5.0 / 3 * bandwidth, [&](uint32_t number) {
    const SurfaceTriangle& t = surfaces_->triangles()[number];
    if (t.surface != surface || !(dot(t.normal, n) > kTurned)) return;
    domain.push_back(number);
    double p[3][2];
    for (int k = 0; k < 3; ++k) {
      const Vec3d q = (t.corner[k] - centre) * scale;
      p[k][0] = dot(q, u), p[k][1] = dot(q, v);
    }
    for (int k = 0; k < 3; ++k) {
      const double* q = p[(k + 1) % 3];
      moments.add_edge(p[k][0], p[k][1], q[0], q[1]);
    }
  });
  std::sort(domain.begin(), domain.end());
  const bool constant = options_.kernel == Kernel::constant;
  const double height = constant ? 1 / kPi : 2 / kPi;
  double a[6];
  for (int k = 0; k < 6; ++k)
    a[k] = height * (moments.plain[k] - (constant ? 0 : moments.squared[k]));
  const Fit f = fit(a);

  double sum[3] = {};
  grid.around(centre, surface, bandwidth, 2, [&](const Hit& hit) {
    ++stats.disc_tests;
    const Vec3d gap = (hit.position - centre) * scale;
    const double x = dot(gap, u), y = dot(gap, v), distance2 = x * x + y * y;
    if (!(distance2 < 1) || !std::binary_search(domain.begin(), domain.end(), hit.triangle)) return;
    ++stats.hits;
    // The projected area of a tilted surface, and so the power on it, is smaller by the cosine.
    const double w = height * (constant ? 1 : 1 - distance2) *
                     (f.level + f.slope_u * x + f.slope_v * y) *
                     dot(surfaces_->triangles()[hit.triangle].normal, n);
    for (int c = 0; c < 3; ++c) sum[c] += w * double(hit.power[c]);
  });
  for (int c = 0; c < 3; ++c) irradiance[c] = std::max(0.0, sum[c] * scale * scale);
}

Gathered LocalLinear::estimate(const segments::SegmentSpan& segments, const Workers& workers,
                               Progress* progress) const {
  Progress unwatched;
  Progress& watched = progress ? *progress : unwatched;
  const std::vector<uint32_t> landing = surfaces_->landings(segments, workers, watched);
  std::vector<Hit> hits;
  std::vector<uint64_t> count(surfaces_->surfaces(), 0);
  for (size_t i = 0; i < segments.count; ++i) {
    if ((i & 0xffff) == 0) watched.check();
    if (landing[i] == kNoTriangle) continue;
    const uint32_t* power = segments.power + 3 * i;
    hits.push_back({end_of(segments, i), {power[0], power[1], power[2]}, landing[i]});
    ++count[surfaces_->triangles()[landing[i]].surface];
  }
  const std::vector<double> bandwidth = bandwidths(count);
  watched.begin("sort hits", 1);
  const Grid grid(std::move(hits), *surfaces_, bandwidth, workers, watched);

  const size_t samples = points_.size();
  Gathered out;
  out.irradiance.assign(3 * samples, 0.0);
  std::vector<Stats> parts((samples + kGrain - 1) / kGrain);
  watched.begin("estimate", samples);
  workers.for_blocks(samples, kGrain, [&](size_t begin, size_t end) {
    std::vector<uint32_t> domain;
    for (size_t i = begin; i < end; ++i) {
      watched.check();
      const uint32_t triangle = surfaces_->nearest(points_[i], normals_[i], kTurned,
                                                   kSampleReach * surfaces_->diagonal());
      if (triangle == kNoTriangle) continue;
      const uint32_t surface = surfaces_->triangles()[triangle].surface;
      if (count[surface] == 0) continue;
      estimate_one(i, grid, surface, bandwidth[surface], domain, &out.irradiance[3 * i],
                   parts[begin / kGrain]);
    }
    watched.advance(end - begin);
  });
  for (const Stats& part : parts) out.stats += part;
  return out;
}

}  // namespace deltalux::estimate
