// SPDX-License-Identifier: Apache-2.0
// Lights as sources of paths: geometry in the present pose, total power, emission of one path.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/random.h"
#include "base/vec.h"
#include "lights/kind.h"
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
  lights::Punctual punctual;  ///< in the present pose; of an area light, of no kind
  uint32_t group = 0;
  uint32_t object = scene::kNone;    ///< the object that carries it, or kNone
  uint32_t material = scene::kNone;  ///< area
  bool two_sided = false;            ///< area
  bool on = true;                    ///< false while its object is removed
  Vec3d power{};                     ///< total emitted per channel, undimmed
  double max_power = 1;              ///< in units of `power`: that in any pose of its object
  double area = 0;                   ///< area light's surface
  Vec3f radiance{};                  ///< area: per channel
  std::vector<uint32_t> triangles;   ///< area: triangle indices within the object
  std::vector<LightTriangle> world;  ///< area: the same in the present pose
  std::vector<float> cumulative;     ///< area: cumulative share of the area, last = 1
  uint32_t source = scene::kNone;    ///< punctual: index into Scene::lights
  /// Of a parallel light: where on its rectangle paths begin; null: evenly.
  std::shared_ptr<const SunMap> map;
  Box bounds;  ///< of the source; empty for a parallel light

  uint64_t first_path = 0, path_count = 0;  ///< its own range of path numbers

  bool is_area() const { return !punctual.kind; }
  bool is_parallel() const { return punctual.kind && punctual.kind->is_parallel(); }
  /// Radiance, or intensity where it is strongest.
  Vec3f strength() const { return is_area() ? radiance : punctual.intensity; }
  /// Power that a path may carry, of the mean.
  double max_weight() const { return map ? double(map->max_weight()) : 1.0; }
};

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

inline Emission emit_from(const lights::Punctual& light, const std::array<float, 4>& random,
                          float weight = 1) {
  const lights::Start start = light.kind->start(light, random);
  return {start.origin, start.direction, weight};
}

/// Start of path `index` of `light` (0 .. path_count). `batch` selects the scrambling, so batches
/// are independent estimates.
Emission emit(const Light& light, uint64_t seed, uint64_t index, uint32_t batches);

/// The batch of a path within its light: contiguous ranges of equal size.
inline uint32_t batch_of(const Light& light, uint64_t index, uint32_t batches) {
  return uint32_t(index * batches / light.path_count);
}

}  // namespace deltalux::trace
