// SPDX-License-Identifier: Apache-2.0
// The only file that uses Embree.
#include "trace/ray_caster.h"

#if DELTALUX_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/error.h"

namespace deltalux::trace {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

void intersect(RTCScene scene, RTCRayHit& ray) {
#if DELTALUX_EMBREE_MAJOR >= 4
  rtcIntersect1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}

bool occluded(RTCScene scene, RTCRay& ray) {
#if DELTALUX_EMBREE_MAJOR >= 4
  rtcOccluded1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
  return ray.tfar < 0;
}

RTCRay make_ray(Vec3f o, Vec3f d, float from, float to) {
  RTCRay ray{};
  ray.org_x = o.x, ray.org_y = o.y, ray.org_z = o.z, ray.tnear = from;
  ray.dir_x = d.x, ray.dir_y = d.y, ray.dir_z = d.z, ray.tfar = to;
  ray.mask = 0xffffffffu;
  return ray;
}

Hit closest_in(RTCScene scene, uint32_t first_primitive, Vec3f o, Vec3f d, float from, float to) {
  RTCRayHit query{};
  query.ray = make_ray(o, d, from, to);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  intersect(scene, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {query.ray.tfar,
          first_primitive + query.hit.primID,
          {query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z}};
}

void occluded16(const int* valid, RTCScene scene, RTCRay16& rays) {
#if DELTALUX_EMBREE_MAJOR >= 4
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &context, &rays);
#endif
}

/// Packets of 16 in the order of `wanted`; unused lanes repeat the packet's first ray.
RayBits occluded_in(RTCScene scene, const RayFan& fan, const RayBits& wanted) {
  RayBits blocked{};
  RTCRay16 rays;
  for (int k = 0; k < 16; ++k) {
    rays.org_x[k] = fan.origin.x, rays.org_y[k] = fan.origin.y, rays.org_z[k] = fan.origin.z;
    rays.tnear[k] = rays.time[k] = 0;
    rays.mask[k] = 0xffffffffu, rays.id[k] = rays.flags[k] = 0;
  }
  size_t index[16];
  int used = 0;
  const auto flush = [&] {
    alignas(64) int valid[16];
    for (int k = 0; k < 16; ++k) {
      const size_t i = index[k < used ? k : 0];
      rays.dir_x[k] = fan.x[i], rays.dir_y[k] = fan.y[i], rays.dir_z[k] = fan.z[i];
      rays.tfar[k] = fan.to;
      valid[k] = k < used ? -1 : 0;
    }
    occluded16(valid, scene, rays);
    for (int k = 0; k < used; ++k)
      if (rays.tfar[k] < 0) blocked[index[k] / 64] |= uint64_t(1) << (index[k] % 64);
    used = 0;
  };
  for (size_t word = 0; word < wanted.size(); ++word)
    for (uint64_t rest = wanted[word]; rest; rest &= rest - 1) {
      index[used++] = 64 * word + size_t(std::countr_zero(rest));
      if (used == 16) flush();
    }
  if (used) flush();
  return blocked;
}

/// One triangle geometry of `vertices` and `triangles`, copied, in a scene of its own.
RTCScene build(RTCDevice device, std::span<const Vec3f> vertices,
               std::span<const std::array<uint32_t, 3>> triangles, Progress* progress) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
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
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  if (progress)
    rtcSetSceneProgressMonitorFunction(
        scene, [](void* p, double) { return !static_cast<Progress*>(p)->cancelled(); }, progress);
  // Built by all threads: the choice among triangles hit at the same distance was the same for a
  // million rays at edges of the atrium, whether one processor built the tree or two.
  rtcCommitScene(scene);
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE) {
    rtcReleaseScene(scene);
    if (error == RTC_ERROR_CANCELLED) throw Cancelled();
    throw Error("Embree could not build its acceleration structure (error " +
                std::to_string(int(error)) + ")");
  }
  return scene;
}

}  // namespace

struct RayCaster::Device {
  RTCDevice device = nullptr;
  RTCScene static_scene = nullptr;
  ~Device() {
    if (static_scene) rtcReleaseScene(static_scene);
    if (device) rtcReleaseDevice(device);
  }
};

RayCaster::RayCaster(const scene::Scene& scene, Progress& progress)
    : device_(std::make_unique<Device>()) {
  device_->device = rtcNewDevice(DELTALUX_EMBREE_OPTIONS);
  if (!device_->device) throw Error("Embree could not be started");
  std::vector<Vec3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
  triangles.reserve(scene.static_primitives());
  for (const scene::Object& object : scene.objects) {
    if (object.movable) continue;
    const uint32_t base = uint32_t(vertices.size());
    for (const Vec3f& v : object.world_vertices()) vertices.push_back(v);
    for (const auto& t : object.triangles)
      triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  }
  device_->static_scene = build(device_->device, vertices, triangles, &progress);
  const Box world = scene.world();
  const float reach = std::max(length(world.low), length(world.high));
  epsilon_ = std::max(1e-5f * 0.5f * world.diagonal(), 1e-6f * reach);
  movables_.resize(scene.objects.size());
  for (uint32_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].movable) update_object(scene, i);
}

RayCaster::~RayCaster() {
  for (Movable& movable : movables_)
    if (movable.scene) rtcReleaseScene(static_cast<RTCScene>(movable.scene));
}

void RayCaster::update_object(const scene::Scene& scene, uint32_t index) {
  if (movables_.size() <= index) movables_.resize(index + 1);
  const scene::Object& object = scene.objects[index];
  Movable& movable = movables_[index];
  if (movable.scene) rtcReleaseScene(static_cast<RTCScene>(movable.scene));
  movable = {};
  movable.first_primitive = object.first_primitive;
  if (object.present && !object.triangles.empty()) {
    const std::vector<Vec3f> vertices = object.world_vertices();
    movable.scene = build(device_->device, vertices, object.triangles, nullptr);
    Box box;
    for (const Vec3f& v : vertices) box.grow(v);
    movable.bounds = box.padded(epsilon_);
  }
  present_.clear();
  for (uint32_t i = 0; i < movables_.size(); ++i)
    if (movables_[i].scene) present_.push_back(i);
}

void RayCaster::drop_objects(size_t count) {
  for (size_t i = count; i < movables_.size(); ++i)
    if (movables_[i].scene) rtcReleaseScene(static_cast<RTCScene>(movables_[i].scene));
  movables_.resize(std::min(count, movables_.size()));
  std::erase_if(present_, [&](uint32_t i) { return i >= count; });
}

bool RayCaster::reaches(const Movable& movable, Vec3f origin, Vec3f direction, float to) const {
  return SlabRay(origin, direction).entry(movable.bounds, to) < kInfinity;
}

Hit RayCaster::closest_static(Vec3f o, Vec3f d, float from, float to) const {
  return closest_in(device_->static_scene, 0, o, d, from, to);
}

Hit RayCaster::closest_object(uint32_t object, Vec3f o, Vec3f d, float from, float to) const {
  const Movable& movable = movables_[object];
  if (!movable.scene) return {};
  return closest_in(static_cast<RTCScene>(movable.scene), movable.first_primitive, o, d, from, to);
}

Hit RayCaster::closer(const Hit& best, uint32_t object, Vec3f o, Vec3f d, float from,
                      float to) const {
  const Movable& movable = movables_[object];
  // Skipping by the padded box is safe: what it hides lies strictly beyond `best`.
  if (!movable.scene || !reaches(movable, o, d, std::min(best.t, to))) return best;
  const Hit hit = closest_object(object, o, d, from, to);
  if (!hit.valid()) return best;
  if (hit.t < best.t || !best.valid()) return hit;
  return hit.t == best.t && hit.primitive < best.primitive ? hit : best;
}

Hit RayCaster::closest(Vec3f o, Vec3f d, float from, float to) const {
  Hit best = closest_static(o, d, from, to);
  for (uint32_t object : present_) best = closer(best, object, o, d, from, to);
  return best;
}

bool RayCaster::occluded_static(Vec3f o, Vec3f d, float to) const {
  RTCRay ray = make_ray(o, d, 0.0f, to);
  return occluded(device_->static_scene, ray);
}

bool RayCaster::occluded_object(uint32_t object, Vec3f o, Vec3f d, float to) const {
  const Movable& movable = movables_[object];
  if (!movable.scene || !reaches(movable, o, d, to)) return false;
  RTCRay ray = make_ray(o, d, 0.0f, to);
  return occluded(static_cast<RTCScene>(movable.scene), ray);
}

bool RayCaster::occluded_movable(Vec3f o, Vec3f d, float to) const {
  for (uint32_t object : present_)
    if (occluded_object(object, o, d, to)) return true;
  return false;
}

RayBits RayCaster::occluded_static(const RayFan& fan, const RayBits& wanted) const {
  return occluded_in(device_->static_scene, fan, wanted);
}

RayBits RayCaster::occluded_object(uint32_t object, const RayFan& fan,
                                   const RayBits& wanted) const {
  const Movable& movable = movables_[object];
  if (!movable.scene) return {};
  return occluded_in(static_cast<RTCScene>(movable.scene), fan, wanted);
}

std::string RayCaster::description() const {
  const auto version = rtcGetDeviceProperty(device_->device, RTC_DEVICE_PROPERTY_VERSION);
  std::string text = "embree " + std::to_string(version / 10000) + "." +
                     std::to_string(version / 100 % 100) + "." + std::to_string(version % 100);
  const bool wide =
      rtcGetDeviceProperty(device_->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
#if defined(__x86_64__)
  text += wide && __builtin_cpu_supports("avx512f") ? ", avx512"
          : __builtin_cpu_supports("avx2")          ? ", avx2"
                                                    : ", sse";
#else
  text += wide ? ", wide" : ", native";
#endif
  return text + ", build " DELTALUX_BUILD_ID;
}

}  // namespace deltalux::trace
