// SPDX-License-Identifier: Apache-2.0
// Wraps Embree; no other file uses it.
#include "trace/embree_scene.h"

#if DELTALUX_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/cpu.h"
#include "base/error.h"
#include "base/fault.h"
#include "trace/scatter.h"

namespace deltalux::trace {
namespace {

#if DELTALUX_EMBREE_MAJOR >= 4
const RTCSceneFlags kSceneFlags =
    RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
using QueryContext = RTCRayQueryContext;
#else
const RTCSceneFlags kSceneFlags = RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
using QueryContext = RTCIntersectContext;
#endif

/// Rays in a packet: as many as AVX2 has lanes.
constexpr int kPacket = 8;

/// Embree would use the best instruction set of the processor, and hits differ in their last bits
/// between them. With AVX2 throughout, all processors that have it agree, at a cost of some 5 % of
/// single rays where there is AVX-512 (benchmarks/NOTEBOOK.md).
bool has_avx2() { return processor_isa() >= Isa::avx2; }

RTCScene handle(const std::shared_ptr<void>& scene) { return static_cast<RTCScene>(scene.get()); }

/// Whether Embree can trace the ray; it may crash on others. NaN fails every comparison.
/// Branch-free, since this is evaluated for every ray.
inline bool can_be_traced(Vec3f o, Vec3f d) {
  constexpr float kMin = 1e-18f, kMax = 4 * kFarthest;
  const float x = std::fabs(d.x), y = std::fabs(d.y), z = std::fabs(d.z);
  const bool near =
      (std::fabs(o.x) <= kFarthest) & (std::fabs(o.y) <= kFarthest) & (std::fabs(o.z) <= kFarthest);
  return near & (x <= kMax) & (y <= kMax) & (z <= kMax) & ((x >= kMin) | (y >= kMin) | (z >= kMin));
}

/// Fills the ray in place: a copy would stall on store forwarding.
inline void set_ray(RTCRay& ray, Vec3f o, Vec3f d, float from, float to) {
  ray.org_x = o.x, ray.org_y = o.y, ray.org_z = o.z, ray.tnear = from;
  ray.dir_x = d.x, ray.dir_y = d.y, ray.dir_z = d.z, ray.time = 0;
  ray.tfar = to;
  ray.mask = 0xffffffffu;
  ray.id = ray.flags = 0;
}

/// Fills a query that has no hit yet.
inline void set_query(RTCRayHit& query, Vec3f o, Vec3f d, float from, float to) {
  set_ray(query.ray, o, d, from, to);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
}

void intersect(RTCScene scene, RTCRayHit& ray) {
#if DELTALUX_EMBREE_MAJOR >= 4
  rtcIntersect1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}

void occluded8(const int* valid, RTCScene scene, RTCRay8& rays) {
#if DELTALUX_EMBREE_MAJOR >= 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &context, &rays);
#endif
}

/// A query that records every hit and accepts none.
struct Collector {
  QueryContext context;  // must be first: Embree passes its address back
  std::span<Intersection> out;
  size_t count = 0;

  static void note(const RTCFilterFunctionNArguments* arguments) {
    Collector& self = *reinterpret_cast<Collector*>(arguments->context);
    if (arguments->valid[0] != -1) return;
    arguments->valid[0] = 0;
    const auto& ray = *reinterpret_cast<const RTCRay*>(arguments->ray);
    const auto& hit = *reinterpret_cast<const RTCHit*>(arguments->hit);
    // Embree may report a triangle twice.
    for (size_t i = 0; i < self.count; ++i)
      if (self.out[i].primitive == hit.primID) return;
    if (self.count == self.out.size()) return;
    const float along = hit.Ng_x * ray.dir_x + hit.Ng_y * ray.dir_y + hit.Ng_z * ray.dir_z;
    self.out[self.count++] = {ray.tfar, along < 0 ? 1 : -1, hit.primID};
  }
};

constexpr unsigned kCovered = 1;  // the number of the geometry of covered triangles

bool transmits(const scene::Scene& scene, uint32_t primitive) {
  const scene::Material& surface = scene.material_of(primitive);
  return surface.kind->transmits(surface);
}

/// A query that records the surfaces that let light pass, and accepts none.
struct Veils {
  static constexpr size_t kMost = 64;
  struct Met {
    Hit hit;
    float transmittance;
  };
  QueryContext context;  // must be first: Embree passes its address back
  const Holes* holes;
  std::array<Met, kMost> met;
  size_t count = 0;

  static void note(const RTCFilterFunctionNArguments* arguments) {
    Veils& self = *reinterpret_cast<Veils*>(arguments->context);
    if (arguments->valid[0] != -1) return;
    arguments->valid[0] = 0;
    const auto& ray = *reinterpret_cast<const RTCRay*>(arguments->ray);
    const auto& hit = *reinterpret_cast<const RTCHit*>(arguments->hit);
    const Holes& holes = *self.holes;
    const uint32_t face = hit.geomID == kCovered ? holes.hidden->face(hit.primID) : hit.primID;
    const uint32_t primitive = holes.first_primitive + face;
    if (self.count == kMost || !transmits(*holes.scene, primitive)) return;
    // Embree may report a triangle twice.
    for (size_t i = 0; i < self.count; ++i)
      if (self.met[i].hit.primitive == primitive) return;
    const scene::Material& surface = holes.scene->material_of(primitive);
    const surfaces::Arrival arrival{normalize(Vec3f{ray.dir_x, ray.dir_y, ray.dir_z}),
                                    {hit.Ng_x, hit.Ng_y, hit.Ng_z},
                                    holes.scene->point_on(primitive, hit.u, hit.v)};
    self.met[self.count++] = {{ray.tfar, primitive, arrival.normal, hit.u, hit.v},
                              surface.kind->transmittance(surface, arrival)};
  }
};

/// Rejects hits where surfaces let rays pass. `number`: of a triangle of the geometry; `light`:
/// whether rays pass where light does.
template <class Number>
void reject_passing(const RTCFilterFunctionNArguments* arguments, bool light,
                    const Number& number) {
  const Holes& holes = *static_cast<const Holes*>(arguments->geometryUserPtr);
  RTCHitN* hits = arguments->hit;
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] != -1) continue;
    const uint32_t primitive =
        holes.first_primitive + number(RTCHitN_primID(hits, arguments->N, i));
    if (holes.scene->lets_pass(primitive, RTCHitN_u(hits, arguments->N, i),
                               RTCHitN_v(hits, arguments->N, i)) ||
        (light && holes.transmits && transmits(*holes.scene, primitive)))
      arguments->valid[i] = 0;
  }
}

void reject_holes(const RTCFilterFunctionNArguments* arguments) {
  reject_passing(arguments, false, [](uint32_t number) { return number; });
}

void reject_unshaded(const RTCFilterFunctionNArguments* arguments) {
  reject_passing(arguments, true, [](uint32_t number) { return number; });
}

/// The same for triangles that others hide in part. Occlusion needs no other test: those block rays
/// as well.
void reject_covered(const RTCFilterFunctionNArguments* arguments, bool light) {
  const Holes& holes = *static_cast<const Holes*>(arguments->geometryUserPtr);
  reject_passing(arguments, light, [&](uint32_t number) { return holes.hidden->face(number); });
}

void reject_unshaded_covered(const RTCFilterFunctionNArguments* arguments) {
  reject_covered(arguments, true);
}

/// Also rejects hits on what others hide in the same plane.
void reject_hidden(const RTCFilterFunctionNArguments* arguments) {
  const Holes& holes = *static_cast<const Holes*>(arguments->geometryUserPtr);
  if (holes.scene) reject_covered(arguments, false);
  const unsigned count = arguments->N;
  RTCHitN* hits = arguments->hit;
  RTCRayN* rays = arguments->ray;
  for (unsigned i = 0; i < count; ++i) {
    if (arguments->valid[i] != -1) continue;
    const Vec3f normal{RTCHitN_Ng_x(hits, count, i), RTCHitN_Ng_y(hits, count, i),
                       RTCHitN_Ng_z(hits, count, i)};
    const Vec3f w{RTCRayN_dir_x(rays, count, i), RTCRayN_dir_y(rays, count, i),
                  RTCRayN_dir_z(rays, count, i)};
    if (holes.hidden->hides(RTCHitN_primID(hits, count, i), RTCHitN_u(hits, count, i),
                            RTCHitN_v(hits, count, i), dot(normal, w) > 0))
      arguments->valid[i] = 0;
  }
}

/// Lets a query that accepts no hit note all of them.
template <class Noting>
void collect(RTCScene scene, Vec3f o, Vec3f d, float to, Noting& noting) {
  RTCRayHit query;
  set_query(query, o, d, 0, to);
#if DELTALUX_EMBREE_MAJOR >= 4
  rtcInitRayQueryContext(&noting.context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  arguments.context = &noting.context;
  arguments.filter = Noting::note;
  rtcIntersect1(scene, &query, &arguments);
#else
  rtcInitIntersectContext(&noting.context);
  noting.context.filter = Noting::note;
  rtcIntersect1(scene, &noting.context, &query);
#endif
}

/// Adds a geometry. `covered`: whether its triangles are those that others hide in part.
void add_geometry(RTCDevice device, RTCScene scene, std::span<const Vec3f> vertices,
                  std::span<const std::array<uint32_t, 3>> triangles, const Holes* holes,
                  bool covered) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (!geometry) throw Error("Embree could not make a geometry: out of memory");
  void* points = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                         sizeof(Vec3f), vertices.size());
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                          triangles.size());
  if ((!points && !vertices.empty()) || (!indices && !triangles.empty())) {
    rtcReleaseGeometry(geometry);
    throw Error("Embree could not allocate its geometry buffers: out of memory");
  }
  if (!vertices.empty()) std::memcpy(points, vertices.data(), vertices.size_bytes());
  if (!triangles.empty()) std::memcpy(indices, triangles.data(), triangles.size_bytes());
  if (holes) {
    rtcSetGeometryUserData(geometry, const_cast<Holes*>(holes));
    rtcSetGeometryIntersectFilterFunction(geometry, covered ? reject_hidden : reject_holes);
    if (holes->scene)
      rtcSetGeometryOccludedFilterFunction(geometry,
                                           covered ? reject_unshaded_covered : reject_unshaded);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

}  // namespace

EmbreeDevice::EmbreeDevice() : device_(nullptr) {
  const std::string options = DELTALUX_EMBREE_OPTIONS;
  RTCDevice device = rtcNewDevice((has_avx2() ? options + ",isa=avx2" : options).c_str());
  if (!device) throw Error("Embree could not be started");
  device_ = std::shared_ptr<void>(device,
                                  [](void* own) { rtcReleaseDevice(static_cast<RTCDevice>(own)); });
}

std::string EmbreeDevice::description() const {
  const auto device = static_cast<RTCDevice>(device_.get());
  const auto version = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION);
  std::string text = "embree " + std::to_string(version / 10000) + "." +
                     std::to_string(version / 100 % 100) + "." + std::to_string(version % 100);
#if defined(__x86_64__)
  return text + (has_avx2() ? ", avx2" : ", sse");  // independent of isa()
#else
  return text + ", native";
#endif
}

EmbreeScene::EmbreeScene(const EmbreeDevice& own, std::span<const Vec3f> vertices,
                         std::span<const std::array<uint32_t, 3>> triangles, Progress* progress,
                         const std::optional<Holes>& holes) {
  if (fault::due(fault::Kind::commit)) throw Error("Embree: a failure on purpose");
  const auto device = static_cast<RTCDevice>(own.device_.get());
  rtcGetDeviceError(device);  // clear the error that an earlier failure may have left
  RTCScene scene = rtcNewScene(device);
  if (!scene) throw Error("Embree could not make a scene: out of memory");
  // Embree's scene lets its device go before its geometries, which still use it.
  scene_ = std::shared_ptr<void>(
      scene, [kept = own.device_](void* gone) { rtcReleaseScene(static_cast<RTCScene>(gone)); });
  if (holes) holes_ = std::make_shared<Holes>(*holes);
  if (!holes || !holes->hidden) {
    add_geometry(device, scene, vertices, triangles, holes_.get(), false);
  } else {
    // The first geometry keeps the numbers of all triangles; those of the second are points there.
    std::vector<std::array<uint32_t, 3>> open(triangles.begin(), triangles.end()), covered;
    for (uint32_t i = 0; i < holes->hidden->size(); ++i) {
      std::array<uint32_t, 3>& own = open[holes->hidden->face(i)];
      covered.push_back(own);
      own = {own[0], own[0], own[0]};
    }
    add_geometry(device, scene, vertices, open, holes->scene ? holes_.get() : nullptr, false);
    add_geometry(device, scene, vertices, covered, holes_.get(), true);
  }
  rtcSetSceneFlags(scene, kSceneFlags);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  if (progress)
    rtcSetSceneProgressMonitorFunction(
        scene, [](void* p, double) { return !static_cast<Progress*>(p)->cancelled(); }, progress);
  // Built by all threads. The choice among triangles hit at the same distance was the same for a
  // million rays at edges of the atrium, whether one thread built the tree or two.
  rtcCommitScene(scene);
  rtcSetSceneProgressMonitorFunction(scene, nullptr, nullptr);
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_CANCELLED) throw Cancelled();
  if (error != RTC_ERROR_NONE)
    throw Error("Embree could not build its acceleration structure (error " +
                std::to_string(int(error)) + ")");
}

Hit EmbreeScene::closest(uint32_t first_primitive, Vec3f o, Vec3f d, float from, float to) const {
  if (!can_be_traced(o, d) || !(from <= to)) return {};
  RTCRayHit query;
  set_query(query, o, d, from, to);
  intersect(handle(scene_), query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const uint32_t own = query.hit.primID;
  return {query.ray.tfar,
          first_primitive + (query.hit.geomID == kCovered ? holes_->hidden->face(own) : own),
          {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z},
          query.hit.u,
          query.hit.v};
}

std::optional<Corners> EmbreeScene::blocker(Vec3f o, Vec3f d, float to) const {
  if (!can_be_traced(o, d) || !(to >= 0)) return {};
  RTCRayHit query;
  set_query(query, o, d, 0, to);
  intersect(handle(scene_), query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const uint32_t own = query.hit.primID;
  if (holes_ && holes_->scene) {
    const uint32_t face = query.hit.geomID == kCovered ? holes_->hidden->face(own) : own;
    const scene::Material& surface = holes_->scene->material_of(holes_->first_primitive + face);
    if (!surface.stops_all()) return {};
  }
  const RTCGeometry geometry = rtcGetGeometry(handle(scene_), query.hit.geomID);
  const auto* points =
      static_cast<const Vec3f*>(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0));
  const auto* indices = static_cast<const std::array<uint32_t, 3>*>(
      rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_INDEX, 0));
  const auto& [a, b, c] = indices[own];
  return Corners{points[a], points[b], points[c]};
}

bool EmbreeScene::occluded(Vec3f o, Vec3f d, float to) const {
  if (!can_be_traced(o, d) || !(to >= 0)) return false;
  RTCRay ray;
  set_ray(ray, o, d, 0.0f, to);
#if DELTALUX_EMBREE_MAJOR >= 4
  rtcOccluded1(handle(scene_), &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(handle(scene_), &context, &ray);
#endif
  return ray.tfar < 0;
}

float EmbreeScene::transmittance(Vec3f o, Vec3f d, float to) const {
  if (!holes_ || !holes_->transmits || !can_be_traced(o, d) || !(to >= 0)) return 1;
  Veils veils{{}, holes_.get(), {}};
  collect(handle(scene_), o, d, to, veils);
  const auto end = veils.met.begin() + long(veils.count);
  std::sort(veils.met.begin(), end, [](const Veils::Met& a, const Veils::Met& b) {
    return std::pair(a.hit.t, a.hit.primitive) < std::pair(b.hit.t, b.hit.primitive);
  });
  const float length_of_d = length(d);
  const Vec3f w = d * (1 / length_of_d);
  float product = 1, passed = -1;
  for (auto own = veils.met.begin(); own != end; ++own) {
    Hit hit = own->hit;
    hit.t *= length_of_d;
    // As for paths: two triangles at their common edge, or in one plane, are one surface.
    if (hit.t <= passed) continue;
    product *= own->transmittance;
    passed = hit.t + passing_distance(o, w, hit, holes_->scene->slack_of(hit.primitive));
  }
  return product;
}

RayBits EmbreeScene::occluded(const RayFan& fan, const RayBits& wanted) const {
  RayBits blocked{};
  if (!(fan.to >= 0)) return blocked;
  // Packets of rays in the order of `wanted`; unused lanes repeat the packet's first ray.
  RTCRay8 rays;
  for (int k = 0; k < kPacket; ++k) {
    rays.org_x[k] = fan.origin.x, rays.org_y[k] = fan.origin.y, rays.org_z[k] = fan.origin.z;
    rays.tnear[k] = rays.time[k] = 0;
    rays.mask[k] = 0xffffffffu, rays.id[k] = rays.flags[k] = 0;
  }
  size_t index[kPacket];
  int used = 0;
  const auto flush = [&] {
    alignas(32) int valid[kPacket];
    for (int k = 0; k < kPacket; ++k) {
      const size_t i = index[k < used ? k : 0];
      rays.dir_x[k] = fan.x[i], rays.dir_y[k] = fan.y[i], rays.dir_z[k] = fan.z[i];
      rays.tfar[k] = fan.to;
      valid[k] = k < used ? -1 : 0;
    }
    occluded8(valid, handle(scene_), rays);
    for (int k = 0; k < used; ++k)
      if (rays.tfar[k] < 0) blocked[index[k] / 64] |= uint64_t(1) << (index[k] % 64);
    used = 0;
  };
  for (size_t word = 0; word < wanted.size(); ++word)
    for (uint64_t rest = wanted[word]; rest; rest &= rest - 1) {
      const size_t i = 64 * word + size_t(std::countr_zero(rest));
      if (!can_be_traced(fan.origin, {fan.x[i], fan.y[i], fan.z[i]})) continue;
      index[used++] = i;
      if (used == kPacket) flush();
    }
  if (used) flush();
  return blocked;
}

size_t EmbreeScene::intersections(Vec3f o, Vec3f d, std::span<Intersection> out) const {
  if (!can_be_traced(o, d)) return 0;
  Collector collector{{}, out};
  collect(handle(scene_), o, d, std::numeric_limits<float>::infinity(), collector);
  return collector.count;
}

}  // namespace deltalux::trace
