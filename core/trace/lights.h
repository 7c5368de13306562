// SPDX-License-Identifier: Apache-2.0
// Lights as sources of paths: geometry in the present pose, total power, sampling of emission.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/assertion.h"
#include "base/random.h"
#include "base/vec.h"
#include "lights/kind.h"
#include "scene/scene.h"
#include "trace/aim_map.h"
#include "trace/light_part.h"
#include "trace/sun_map.h"

namespace deltalux::trace {

/// One emissive triangle in world space: a corner and two edges.
struct LightTriangle {
  Vec3f corner, edge_u, edge_v;
  Vec3f normal;     ///< unit, front side
  float slack = 0;  ///< offset at which rays start and end
  /// Radiance relative to the light's mean, as the eye weighs it.
  float brightness = 1;
  friend bool operator==(const LightTriangle&, const LightTriangle&) = default;
};

/// An area light is one connected piece of an object's emissive triangles of one material, or
/// several that lie close together, of many; a punctual light is one entry of Scene::lights. All
/// paths of a light start with the same power, except those of lights with a map. All parts of a
/// light have the same hue, that of their mean.
struct Light {
  lights::Punctual punctual;  ///< in the present pose; without a kind for an area light
  uint32_t group = 0;
  uint32_t object = scene::kNone;    ///< the object that it is attached to, or kNone
  uint32_t material = scene::kNone;  ///< area
  bool two_sided = false;            ///< area
  bool on = true;                    ///< false while its object is removed
  Vec3d power{};                     ///< total emitted per channel, without dimming
  double max_power = 1;  ///< largest possible power in any pose of its object, relative to `power`
  /// Binary digits by which the quantum of its paths' power is finer than EnergyScale::quantum;
  /// negative: coarser. See choose_fineness().
  int finer = 0;
  uint32_t sums = 0;  ///< which of a session's sums its paths add to, see session::SumGroup
  /// Radiance of an area light, the mean over its surface; otherwise the maximum intensity.
  Vec3f strength{};
  float brightest_part = 1;  ///< area lights: the largest LightTriangle::brightness
  /// Versine of the half angle of the cone that most of its light leaves in, see
  /// lights::Kind::concentration(); 1 for an area light.
  float concentration = 1;
  double area = 0;                   ///< of its surface; 0 for a punctual light
  std::vector<LightPart> parts;      ///< area lights: its triangles
  std::vector<LightTriangle> world;  ///< area lights: its triangles in the present pose
  std::vector<float> cumulative;     ///< area lights: cumulative share of the power, last = 1
  uint32_t source = scene::kNone;    ///< punctual lights: index into Scene::lights
  /// For parallel lights: distribution of path starts over the light's rectangle; null: uniform.
  std::shared_ptr<const SunMap> map;
  /// For area lights: places that half of the paths go to; null: all directions are
  /// cosine-distributed.
  std::shared_ptr<const AimMap> aims;
  Box bounds;  ///< of the light's geometry; empty for a parallel light

  uint64_t first_path = 0, path_count = 0;  ///< range of its path numbers

  bool is_parallel() const { return punctual.kind && punctual.kind->is_parallel(); }
  /// The largest power of a path, relative to the mean.
  double max_weight() const {
    return map ? double(map->max_weight()) : aims ? double(AimMap::max_weight()) : 1.0;
  }
};

/// Finds the lights of a scene (kNone: of all objects; otherwise of one object). Punctual lights
/// come first, then area lights by object, so that lights of added objects come last. Throws
/// SceneError.
std::vector<Light> find_lights(const scene::Scene& scene, uint32_t only_object = scene::kNone);
/// Moves `light` to the present pose of its object.
void place_light(const scene::Scene& scene, Light& light);

/// Whether two states of one light send the same light.
bool sends_alike(const Light& a, const Light& b);
/// Whether what the light sends may reach a point of the box; false only if none does.
bool may_reach(const Light& light, const Box& box);

/// Every light group gets at least this share of all paths, divided by the number of groups, since
/// other groups may be dimmed.
inline constexpr double kGroupFloor = 0.25;

/// Divides `paths` among lights in proportion to `shares`, except for the floor of each group; path
/// counts are multiples of `batches` where possible, and at least one row of batches per light.
/// Numbers the paths consecutively.
void allot_paths(std::vector<Light>& lights, std::span<const double> shares, uint64_t paths,
                 uint32_t batches);
/// The shares for which every path of every light has the same photopic power.
std::vector<double> shares_by_power(std::span<const Light> lights);

/// The start of a path.
struct Emission {
  Vec3f origin, direction;
  float weight = 1;  ///< power relative to the mean of the light's paths
};

inline Emission emit_from(const lights::Punctual& light, const std::array<float, 4>& random,
                          float weight = 1) {
  const lights::Start start = light.kind->start(light, random);
  return {start.origin, start.direction, weight};
}

/// The start of path `index` of `light` (0 .. path_count - 1). Each of the `batches` has its own
/// scrambling, so that batches are independent estimates.
Emission emit(const Light& light, uint64_t seed, uint64_t index, uint32_t batches);

/// The batch of a path within its light; batches are contiguous ranges of equal size.
inline uint32_t batch_of(const Light& light, uint64_t index, uint32_t batches) {
  DELTALUX_ASSERT(index < light.path_count);
  return uint32_t(index * batches / light.path_count);
}
/// The index within its light of a batch's first path; of batch `batches`: the number of paths.
inline uint64_t batch_begin(const Light& light, uint32_t batch, uint32_t batches) {
  return (batch * light.path_count + batches - 1) / batches;
}

}  // namespace deltalux::trace
