// SPDX-License-Identifier: Apache-2.0
// Cost of depositing segments into discs, as ratios to raw Embree rays on the same segments and to
// Embree's oriented discs with a filter, all in one process. Prints JSON.
// Usage: deposit_bench [discs...]   (default 100000 1000000)
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <numeric>
#include <vector>

#if DELTALUX_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "base/parallel.h"
#include "base/random.h"
#include "base/vec.h"
#include "estimate/disc_index/disc_index.h"

using namespace deltalux;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kTau = 2 * std::numbers::pi_v<float>;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// ---- scene: a two-storey arcaded courtyard -------------------------------------------------

struct Mesh {
  std::vector<Vec3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;

  /// A grid of (nu+1) x (nv+1) points f(i/nu, j/nv); front where d/du x d/dv points.
  template <class F>
  void grid(int nu, int nv, F&& f) {
    const uint32_t base = uint32_t(vertices.size());
    for (int j = 0; j <= nv; ++j)
      for (int i = 0; i <= nu; ++i)
        vertices.push_back(f(float(i) / float(nu), float(j) / float(nv)));
    for (int j = 0; j < nv; ++j)
      for (int i = 0; i < nu; ++i) {
        const uint32_t a = base + uint32_t(j * (nu + 1) + i), b = a + 1, c = a + uint32_t(nu) + 1;
        triangles.push_back({a, b, c + 1});
        triangles.push_back({a, c + 1, c});
      }
  }
  void quad(Vec3f corner, Vec3f u, Vec3f v, float cell = 1.0f) {
    const auto cells = [&](Vec3f e) { return std::max(1, int(std::lround(length(e) / cell))); };
    grid(cells(u), cells(v), [&](float s, float t) { return corner + u * s + v * t; });
  }
  void box(Vec3f low, Vec3f high, float cell = 1.0f) {
    const Vec3f e = high - low, x{e.x, 0, 0}, y{0, e.y, 0}, z{0, 0, e.z};
    quad(low, y, x, cell), quad(low + z, x, y, cell);
    quad(low, x, z, cell), quad(low + y, z, x, cell);
    quad(low, z, y, cell), quad(low + x, y, z, cell);
  }
  /// Surface of revolution about the vertical through `foot`; radius(t), t from 0 to 1.
  template <class F>
  void lathe(Vec3f foot, float height, int sides, int rings, F&& radius) {
    grid(sides, rings, [&](float s, float t) {
      const float r = radius(t);
      return foot + Vec3f{r * std::cos(kTau * s), r * std::sin(kTau * s), height * t};
    });
  }
  /// Arch of half a ring in the vertical plane of `along`, standing on `foot`.
  void arch(Vec3f foot, Vec3f along, float width, float depth) {
    const Vec3f across = cross(Vec3f{0, 0, 1}, along) * depth;
    const float r = 0.5f * width;
    const Vec3f centre = foot + along * r;
    const auto rim = [&](float s, float radius) {
      const float a = 0.5f * kTau * s;
      return centre + along * (radius * std::cos(a)) + Vec3f{0, 0, radius * std::sin(a)};
    };
    grid(24, 4, [&](float s, float t) { return rim(s, r) + across * (t - 0.5f); });
    for (const float side : {-0.5f, 0.5f})
      grid(24, 3, [&](float s, float t) {
        return rim(side < 0 ? s : 1 - s, r + 0.4f * t) + across * side;
      });
  }
};

Mesh make_courtyard() {
  Mesh m;
  constexpr float kX = 32, kY = 24, kStorey = 5, kDepth = 4, kBay = 3;
  m.quad({0, 0, 0}, {kX, 0, 0}, {0, kY, 0}, 0.5f);
  m.quad({0, 0, 2 * kStorey}, {0, kY, 0}, {kX, 0, 0}, 0.5f);
  m.quad({0, 0, 0}, {0, 0, 2 * kStorey}, {kX, 0, 0}, 0.5f);
  m.quad({0, kY, 0}, {kX, 0, 0}, {0, 0, 2 * kStorey}, 0.5f);
  m.quad({0, 0, 0}, {0, kY, 0}, {0, 0, 2 * kStorey}, 0.5f);
  m.quad({kX, 0, 0}, {0, 0, 2 * kStorey}, {0, kY, 0}, 0.5f);
  const float low = kStorey - 0.3f;
  m.box({0, 0, low}, {kX, kDepth, kStorey}, 0.5f);
  m.box({0, kY - kDepth, low}, {kX, kY, kStorey}, 0.5f);
  m.box({0, kDepth, low}, {kDepth, kY - kDepth, kStorey}, 0.5f);
  m.box({kX - kDepth, kDepth, low}, {kX, kY - kDepth, kStorey}, 0.5f);
  const auto bay = [&](Vec3f foot, Vec3f along, bool upper) {
    m.lathe(foot, 3.2f, 24, 18, [](float t) {
      return 0.22f + 0.12f * std::exp(-30 * t) + 0.12f * std::exp(-30 * (1 - t)) - 0.04f * t;
    });
    m.arch(foot + Vec3f{0, 0, 3.1f}, along, kBay, 0.5f);
    if (!upper) return;
    for (int i = 1; i < 14; ++i)
      m.lathe(foot + along * (float(i) * kBay / 14), 0.8f, 12, 12, [](float t) {
        return 0.035f + 0.03f * std::sin(0.5f * kTau * t) * std::sin(0.5f * kTau * t);
      });
    const Vec3f side = cross(Vec3f{0, 0, 1}, along) * 0.08f, end = foot + along * kBay;
    m.box(min(foot - side, end + side) + Vec3f{-0.02f, -0.02f, 0.8f},
          max(foot + side, end + side) + Vec3f{0.02f, 0.02f, 0.9f}, 0.3f);
  };
  for (const bool upper : {false, true}) {
    const float z = upper ? kStorey : 0;
    for (float x = kDepth; x < kX - kDepth; x += kBay) {
      bay({x, kDepth, z}, {1, 0, 0}, upper);
      bay({x, kY - kDepth, z}, {1, 0, 0}, upper);
    }
    for (float y = kDepth; y < kY - kDepth; y += kBay) {
      bay({kDepth, y, z}, {0, 1, 0}, upper);
      bay({kX - kDepth, y, z}, {0, 1, 0}, upper);
    }
  }
  m.lathe({kX / 2, kY / 2, 0}, 1.2f, 96, 48,
          [](float t) { return 2.2f - 1.6f * t * t + 0.1f * std::sin(9 * kTau * t); });
  for (int i = 0; i < 16; ++i) {  // potted trees
    const float a = kTau * float(i) / 16;
    const Vec3f foot{kX / 2 + 9 * std::cos(a), kY / 2 + 5.5f * std::sin(a), 0};
    m.lathe(foot, 0.7f, 24, 8, [](float t) { return 0.3f + 0.15f * t; });
    m.lathe(foot + Vec3f{0, 0, 1.2f}, 1.6f, 48, 32, [i](float t) {
      return 0.02f + 0.8f * std::sqrt(t * (1 - t)) * (1 + 0.15f * std::sin(float(30 + i) * t));
    });
    m.box(foot + Vec3f{0.6f, -0.6f, 0.35f}, foot + Vec3f{1.0f, 0.6f, 0.45f}, 0.2f);
  }
  return m;
}

// ---- Embree ----------------------------------------------------------------------------------

/// What a filter needs, behind the context that Embree passes through.
struct Context {
#if DELTALUX_EMBREE_MAJOR >= 4
  RTCRayQueryContext base;
#else
  RTCIntersectContext base;
#endif
  uint32_t* hits = nullptr;
  uint32_t count = 0;

  Context() {
#if DELTALUX_EMBREE_MAJOR >= 4
    rtcInitRayQueryContext(&base);
#else
    rtcInitIntersectContext(&base);
#endif
  }
};

void intersect(RTCScene scene, Context& context, RTCRayHit& ray) {
#if DELTALUX_EMBREE_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context.base;
  rtcIntersect1(scene, &ray, &arguments);
#else
  rtcIntersect1(scene, &context.base, &ray);
#endif
}

RTCRayHit make_ray(Vec3f o, Vec3f d, float from, float to) {
  RTCRayHit r{};
  r.ray.org_x = o.x, r.ray.org_y = o.y, r.ray.org_z = o.z, r.ray.tnear = from;
  r.ray.dir_x = d.x, r.ray.dir_y = d.y, r.ray.dir_z = d.z, r.ray.tfar = to;
  r.ray.mask = 0xffffffffu;
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  return r;
}

RTCScene commit(RTCDevice device, RTCGeometry geometry) {
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

RTCScene triangle_scene(RTCDevice device, const Mesh& mesh) {
  RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                    mesh.vertices.size());
  void* t = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                    mesh.triangles.size());
  std::copy(mesh.vertices.begin(), mesh.vertices.end(), static_cast<Vec3f*>(v));
  std::copy(mesh.triangles.begin(), mesh.triangles.end(), static_cast<std::array<uint32_t, 3>*>(t));
  return commit(device, g);
}

/// Keeps every disc that the ray crosses from the front; lets the traversal go on.
void collect(const RTCFilterFunctionNArguments* a) {
  auto* context = reinterpret_cast<Context*>(a->context);
  const auto* ray = reinterpret_cast<const RTCRay*>(a->ray);
  const auto* hit = reinterpret_cast<const RTCHit*>(a->hit);
  if (hit->Ng_x * ray->dir_x + hit->Ng_y * ray->dir_y + hit->Ng_z * ray->dir_z < 0)
    context->hits[context->count++] = hit->primID;
  a->valid[0] = 0;
}

RTCScene disc_scene(RTCDevice device, const samples::DiscSet& discs) {
  RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
  auto* v = static_cast<float*>(
      rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, discs.size()));
  auto* n = static_cast<Vec3f*>(
      rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, 12, discs.size()));
  for (size_t i = 0; i < discs.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) v[4 * i + size_t(axis)] = discs.centre[i][axis];
    v[4 * i + 3] = discs.radius[i];
    n[i] = discs.normal[i];
  }
  rtcSetGeometryIntersectFilterFunction(g, collect);
  return commit(device, g);
}

// ---- discs and segments ------------------------------------------------------------------------

/// Discs uniform over the area, radius half the spacing.
samples::DiscSet scatter_discs(const Mesh& mesh, size_t count) {
  std::vector<double> sum{0.0};
  for (const auto& t : mesh.triangles) {
    const Vec3f a = mesh.vertices[t[0]];
    sum.push_back(sum.back() +
                  0.5 * length(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a)));
  }
  const float radius = 0.5f * float(std::sqrt(sum.back() / double(count)));
  samples::DiscSet discs;
  const PathRandom random(7, count);
  size_t t = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const double area = (i + double(random(i, 0))) / double(count) * sum.back();
    while (sum[t + 1] < area && t + 2 < sum.size()) ++t;
    const Vec3f a = mesh.vertices[mesh.triangles[t][0]], b = mesh.vertices[mesh.triangles[t][1]],
                c = mesh.vertices[mesh.triangles[t][2]];
    const float root = std::sqrt(random(i, 1)), v = random(i, 2) * root;
    discs.centre.push_back(a * (1 - root) + b * (root - v) + c * v);
    discs.normal.push_back(normalize(cross(b - a, c - a)));
    discs.radius.push_back(radius);
    discs.outline.push_back(samples::kWholeDisc);
    discs.id.push_back(i);
  }
  // Samples arrive in the order of a space-filling walk over the surfaces at best: keep mesh order.
  return discs;
}

struct Segments {
  std::vector<float> ox, oy, oz, dx, dy, dz, length, extended;
  std::vector<uint32_t> power;
  size_t size() const { return ox.size(); }
  segments::SegmentSpan span() const {
    return {size(),    ox.data(),     oy.data(),       oz.data(),    dx.data(), dy.data(),
            dz.data(), length.data(), extended.data(), power.data(), nullptr};
  }
  Vec3f origin(size_t i) const { return {ox[i], oy[i], oz[i]}; }
  Vec3f direction(size_t i) const { return {dx[i], dy[i], dz[i]}; }
};

Vec3f cosine_direction(Vec3f n, float a, float b) {
  Vec3f u, v;
  tangent_frame(n, u, v);
  const float r = std::sqrt(a), phi = kTau * b;
  return normalize(u * (r * std::cos(phi)) + v * (r * std::sin(phi)) + n * std::sqrt(1 - a));
}

/// Diffuse light paths from lamps under the arcades and from the sky of the court, shuffled: every
/// segment is far from the one before it.
Segments trace_segments(RTCScene scene, size_t count) {
  std::vector<std::array<float, 8>> all;
  for (uint32_t path = 0; all.size() < count; ++path) {
    const PathRandom random(11, path);
    Vec3f o{6 + 20 * random(0, 0), 6 + 12 * random(0, 1), 9.9f}, n{0, 0, -1};
    if (path % 4 == 0) {
      o = {2 + 7 * std::floor(4 * random(0, 0)), path % 8 == 0 ? 2.0f : 22.0f,
           path % 16 < 8 ? 4.5f : 9.5f};
      n = normalize(Vec3f{random(0, 4) - 0.5f, random(0, 5) - 0.5f, random(0, 6) - 0.5f});
    }
    for (uint32_t bounce = 0; bounce < 12; ++bounce) {
      const Vec3f d = cosine_direction(n, random(bounce, 2), random(bounce, 3));
      RTCRayHit hit = make_ray(o, d, 0, kInfinity);
      Context context;
      intersect(scene, context, hit);
      if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
      const float t = hit.ray.tfar;
      RTCRayHit next = make_ray(o, d, t + 1e-3f, kInfinity);
      intersect(scene, context, next);
      all.push_back({o.x, o.y, o.z, d.x, d.y, d.z, t, next.ray.tfar});
      n = normalize(Vec3f{hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z});
      if (dot(n, d) > 0) n = -n;
      if (random(bounce, 7) > 0.65f) break;
      o = o + d * t + n * 2e-4f;
    }
  }
  for (uint32_t i = uint32_t(all.size()); i > 1; --i) std::swap(all[i - 1], all[combine(3, i) % i]);
  Segments s;
  for (size_t i = 0; i < count; ++i) {
    s.ox.push_back(all[i][0]), s.oy.push_back(all[i][1]), s.oz.push_back(all[i][2]);
    s.dx.push_back(all[i][3]), s.dy.push_back(all[i][4]), s.dz.push_back(all[i][5]);
    s.length.push_back(all[i][6]), s.extended.push_back(all[i][7]);
    s.power.insert(s.power.end(), {1000, 900, 800});
  }
  return s;
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + long(v.size() / 2), v.end());
  return v[v.size() / 2];
}

// long: one measurement after another, each of a few lines.
void measure(const Mesh& mesh, RTCDevice device, RTCScene rays, const Segments& segments,
             size_t count, bool last) {
  const samples::DiscSet discs = scatter_discs(mesh, count);
  const Workers workers(1);
  std::vector<double> build;
  for (int i = 0; i < 3; ++i) {
    const double start = cpu_seconds();
    const estimate::DiscIndex index(discs, segments::SegmentEnd::first, workers);
    build.push_back(cpu_seconds() - start);
  }
  const estimate::DiscIndex first(discs, segments::SegmentEnd::first, workers),
      bounded(discs, segments::SegmentEnd::bounded, workers);
  RTCScene embree = disc_scene(device, discs);
  std::vector<int64_t> own(3 * count), theirs(3 * count), scratch(3 * count);
  std::vector<estimate::HitSlots> slots(segments.size());

  const size_t n = segments.size();
  estimate::Stats stats;
  std::vector<uint32_t> found(1 << 16);
  double checksum = 0;
  const auto raw = [&] {
    Context context;
    for (size_t i = 0; i < n; ++i) {
      RTCRayHit ray = make_ray(segments.origin(i), segments.direction(i), 0, kInfinity);
      intersect(rays, context, ray);
      checksum += ray.ray.tfar;
    }
  };
  const auto deposit = [&] {
    stats = first.accumulate(segments.span(), 1, {own.data(), count, false}, slots.data());
  };
  const auto deposit_bounded = [&] {
    bounded.accumulate(segments.span(), 1, {scratch.data(), count, false}, slots.data());
  };
  uint64_t embree_hits = 0;
  const auto embree_discs = [&] {
    embree_hits = 0;
    const estimate::EnergySums sums{theirs.data(), count, false};
    for (size_t i = 0; i < n; ++i) {
      Context context;
      context.hits = found.data();
      RTCRayHit ray = make_ray(segments.origin(i), segments.direction(i), 0, segments.length[i]);
      intersect(embree, context, ray);
      for (uint32_t k = 0; k < context.count; ++k)
        sums.add(0, discs.id[found[k]], &segments.power[3 * i], 1);
      embree_hits += context.count;
    }
  };
  std::vector<double> seconds[4];
  for (int repetition = 0; repetition < 5; ++repetition) {
    const auto timed = [&](int which, auto&& body) {
      const double start = cpu_seconds();
      body();
      seconds[which].push_back(cpu_seconds() - start);
    };
    timed(0, raw), timed(1, deposit), timed(2, deposit_bounded), timed(3, embree_discs);
  }
  const double ray = median(seconds[0]), own_time = median(seconds[1]);
  const double nano = 1e9 / double(n);
  std::printf(
      "  {\"discs\": %zu, \"segments\": %zu, \"hits_per_segment\": %.3f, "
      "\"nodes_per_segment\": %.2f, \"disc_tests_per_segment\": %.2f,\n"
      "   \"embree_disc_hits_per_segment\": %.3f, \"build_seconds\": %.3f, "
      "\"bytes_per_disc\": %.1f,\n"
      "   \"raw_ray_ns\": %.1f, \"deposit_ns\": %.1f, \"deposit_bounded_ns\": %.1f, "
      "\"embree_disc_ns\": %.1f,\n"
      "   \"deposit_in_rays\": %.3f, \"deposit_bounded_in_rays\": %.3f, "
      "\"faster_than_embree_discs\": %.2f}%s\n",
      count, n, double(stats.hits) / double(n), double(stats.node_tests) / double(n),
      double(stats.disc_tests) / double(n), double(embree_hits) / double(n), median(build),
      double(first.bytes()) / double(count), ray * nano, own_time * nano, median(seconds[2]) * nano,
      median(seconds[3]) * nano, own_time / ray, median(seconds[2]) / ray,
      median(seconds[3]) / own_time, last ? "" : ",");
  if (!(checksum > 0)) std::fprintf(stderr, "no rays\n");
  rtcReleaseScene(embree);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<size_t> counts;
  for (int i = 1; i < argc; ++i) counts.push_back(std::strtoull(argv[i], nullptr, 10));
  if (counts.empty()) counts = {100000, 1000000};
  const Mesh mesh = make_courtyard();
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = triangle_scene(device, mesh);
  const Segments segments = trace_segments(scene, 400000);
  double mean = 0;
  for (const float t : segments.length) mean += double(t) / double(segments.size());
  std::printf("{\"triangles\": %zu, \"mean_length_m\": %.2f, \"results\": [\n",
              mesh.triangles.size(), mean);
  for (size_t i = 0; i < counts.size(); ++i)
    measure(mesh, device, scene, segments, counts[i], i + 1 == counts.size());
  std::printf("]}\n");
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}
