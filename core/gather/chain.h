// SPDX-License-Identifier: Apache-2.0
// What a ray sees that meets something near: a cell there is averaged over what the ray is to tell
// apart, contact shadows, so the ray goes on as a path does.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "direct/light_shape.h"
#include "gather/cells.h"
#include "gather/sample_rays.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// The scene as it is now.
struct Present {
  const scene::Scene& scene;
  const trace::RayCaster& caster;
  std::span<const trace::Light> lights;
  std::span<const direct::Receiver> receivers;  ///< per sample, world
  const Cells& cells;
  const Guiding& guiding;
};

inline constexpr uint32_t kMostVertices = 16;
inline constexpr uint32_t kDark = kNoCell;  // where a ray meets nothing

/// Surface that a chain touches: direct light there of one light that stands for all.
struct Vertex {
  uint32_t material = 0;
  uint32_t light = scene::kNone;  ///< or kNone: no light shines there, whatever is between
  std::array<float, 3> direct{};  ///< irradiance, undimmed, times the weight of the way there
  friend bool operator==(const Vertex&, const Vertex&) = default;
};

/// Beyond the second vertex chains go on by chance: fixed, for reflectances may change.
inline constexpr uint32_t kSurely = 4;
inline constexpr float kGoesOn = 0.7f;
/// Where a chain passes, for whoever looks for what an edit touches.
struct Passage {
  Box near;            ///< all flights but the last
  Vec3f origin, last;  ///< the last flight, if any: to its end, or far beyond the world
};

/// A path that begins at a near hit; beyond its last vertex is `end`, a cell or nothing.
struct Chain {
  std::array<Vertex, kMostVertices> vertex;
  uint32_t count = 0;
  uint32_t end = kDark;
  float weight = 1;  ///< of the end; the vertices' light is weighted
  Passage passage;
};

/// Three random numbers in [0, 1).
struct Draw {
  float light, u, v;
};

/// Direct light at a point by one shadow ray.
class OneLight {
 public:
  OneLight(std::span<const trace::Light> lights, uint32_t groups, uint64_t seed);
  /// A light by about its unshadowed share, half of all lights' and half within its group, so that
  /// no group is left out where others are dimmed.
  void ask(const trace::RayCaster& caster, const direct::Receiver& receiver, const Draw& draw,
           Vertex& out) const;

 private:
  std::span<const trace::Light> lights_;
  std::vector<std::optional<direct::LightShape>> shapes_;
  uint32_t groups_;
};

class ChainTracer {
 public:
  ChainTracer(const Present& present, const CellFinder& finder, uint64_t seed);
  /// Goes on from the first hit, which is near. `key`: of the ray.
  Chain trace(uint64_t key, Vec3f origin, Vec3f w, const trace::Hit& hit) const;

 private:
  const Present& present_;
  const CellFinder& finder_;
  OneLight one_light_;
  uint64_t seed_;
};

}  // namespace deltalux::gather
