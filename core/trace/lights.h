// SPDX-License-Identifier: Apache-2.0
// Lights as sources of paths: geometry in the present pose, total power, emission of one path.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/random.h"
#include "base/vec.h"
#include "scene/scene.h"
#include "trace/sun_map.h"

namespace deltalux::trace {

/// One emissive triangle in world space: corner and edges.
struct LightTriangle {
  Vec3f corner, edge_u, edge_v;
  Vec3f normal;     ///< unit, front side
  float slack = 0;  ///< rays start and end this far off it
};

/// An area light is one connected piece of an object's triangles of one material; a punctual light
/// is one entry of Scene::lights. Every path of a light carries the same power at birth, but for
/// those of a sun with a map.
struct Light {
  scene::LightKind kind = scene::LightKind::area;
  uint32_t group = 0;
  uint32_t object = scene::kNone;    ///< the object that carries it, or kNone
  uint32_t material = scene::kNone;  ///< area
  bool two_sided = false;            ///< area
  bool on = true;                    ///< false while its object is removed
  Vec3d power{};                     ///< total emitted per channel, undimmed
  double most_power = 1;             ///< in units of `power`: that in any pose of its object
  double area = 0;                   ///< area light's surface; a sun's emission rectangle
  Vec3f radiance{};                  ///< area: per channel
  std::vector<uint32_t> triangles;   ///< area: triangle indices within the object
  std::vector<LightTriangle> world;  ///< area: the same in the present pose
  std::vector<float> cumulative;     ///< area: cumulative share of the area, last = 1
  uint32_t punctual = scene::kNone;  ///< index into Scene::lights
  Vec3f position{}, direction{};     ///< punctual, present pose, world
  Vec3f intensity{};                 ///< punctual (sun: irradiance)
  float inner_versine = 0, outer_versine = 1;  ///< spot, see scene::PunctualLight
  Vec3f frame_u{}, frame_v{}, corner{};        ///< sun: its rectangle spans corner + a u + b v
  std::shared_ptr<const SunMap> map;           ///< sun: where on it paths begin; null = evenly
  Box bounds;                                  ///< of the source; empty for a sun

  uint64_t first_path = 0, path_count = 0;  ///< its own range of path numbers

  /// Power that a path may carry, of the mean.
  double most_weight() const { return map ? double(map->most_weight()) : 1.0; }
};

/// KHR_lights_punctual: full inside the inner cone, zero outside the outer one. `versine` is 1 -
/// cosine of the angle to the axis.
inline double spot_falloff(const Light& light, double versine) {
  const double inner = light.inner_versine, outer = light.outer_versine;
  if (versine <= inner) return 1;
  if (!(versine < outer)) return 0;
  const double x = (outer - versine) / (outer - inner);
  return x * x;
}

/// Of a spot, its falloff as a weight: power per intensity.
double spot_solid_angle(const Light& light);
/// A direction of a spot's light, by its intensity. `u`, `v`: random, in [0, 1).
Vec3f spot_direction(const Light& light, float u, float v);

/// Finds the lights of a scene (kNone = all objects, else only that object's): punctual ones first,
/// then object by object, so that those of an object that is added come last. Throws SceneError.
std::vector<Light> find_lights(const scene::Scene& scene, uint32_t only_object = scene::kNone);
/// Moves `light` to the present pose of its object.
void place_light(const scene::Scene& scene, Light& light);

/// Each light group gets at least this share of all paths, divided by the number of groups: the
/// others may be dimmed.
inline constexpr double kGroupFloor = 0.25;

/// Splits `paths` among lights in proportion to `shares` but for the floor of each group, a
/// multiple of `batches` each where that is possible, at least one batch row for every light;
/// numbers them consecutively.
void allot_paths(std::vector<Light>& lights, std::span<const double> shares, uint64_t paths,
                 uint32_t batches);
/// The shares that give every path of every light the same photopic power.
std::vector<double> shares_by_power(std::span<const Light> lights);

struct Emission {
  Vec3f origin, direction;
  float weight = 1;  ///< of the mean path's power
};

/// Of a sun, at a place of its rectangle, in [0, 1).
inline Emission emit_from_sun(const Light& light, float u, float v, float weight = 1) {
  return {light.corner + light.frame_u * u + light.frame_v * v, light.direction, weight};
}

/// Start of path `index` of `light` (0 .. path_count). `batch` selects the scrambling, so batches
/// are independent estimates.
Emission emit(const Light& light, uint64_t seed, uint64_t index, uint32_t batches);

/// The batch of a path within its light: contiguous ranges of equal size.
inline uint32_t batch_of(const Light& light, uint64_t index, uint32_t batches) {
  return uint32_t(index * batches / light.path_count);
}

}  // namespace deltalux::trace
