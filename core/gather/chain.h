// SPDX-License-Identifier: Apache-2.0
// What a ray sees that meets something near: a cell there is averaged over what the ray is to tell
// apart, contact shadows, so the ray goes on as a path does.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "direct/light_shape.h"
#include "gather/cells.h"
#include "gather/suns.h"
#include "gather/turn.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/scatter.h"

namespace deltalux::gather {

/// The scene as it is now.
struct Present {
  const scene::Scene& scene;
  const trace::RayCaster& caster;
  std::span<const trace::Light> lights;
  std::span<const direct::Receiver> receivers;  ///< per sample, world
  const Cells& cells;
  const Guiding& guiding;
  const Beams& beams;
  const Suns& suns;
  /// Where a ray lands, on the side that it meets.
  direct::Receiver landing(Vec3f origin, Vec3f w, const trace::Hit& hit) const {
    const uint32_t object = scene.object_of(hit.primitive);
    return {origin + w * hit.t, trace::facing_normal(hit, w),
            scene.objects[object].movable ? object : scene::kNone, scene.slack_of(hit.primitive)};
  }
};

inline constexpr uint32_t kMaxTouched = 16;
inline constexpr uint32_t kMaxVertices = kMaxTouched + 1;  ///< its end may have two, by then
inline constexpr uint32_t kDark = kNoCell;                 // where a ray meets nothing

/// Surface that a chain touches: direct light there of one light that stands for all.
struct Vertex {
  static constexpr uint32_t kEnd = 0x80000000u;  ///< in `material`: it is the chain's end itself
  uint32_t material = 0;
  uint32_t light = scene::kNone;  ///< or kNone: no light shines there, whatever is between
  std::array<float, 3> direct{};  ///< irradiance, undimmed, times the weight of the way there
  bool is_of_end() const { return material & kEnd; }
  friend bool operator==(const Vertex&, const Vertex&) = default;
};

/// Behind the third vertex chains go on by chance: fixed, for reflectances may change.
inline constexpr uint32_t kSurely = 2;
inline constexpr float kGoesOn = 0.7f;
/// Where a chain passes, for whoever looks for what an edit touches.
struct Passage {
  Box near;            ///< all flights but the last
  Vec3f origin, last;  ///< the last flight, if any: to its end, or far beyond the world
};

/// A path that begins at a near hit, or ends at a far one; beyond its last vertex is `end`, a cell
/// or nothing. Cells hold no light that comes straight from a beam's lamp, or from a sun that is
/// asked for: the end may have a vertex of its own for each of these.
struct Chain {
  std::array<Vertex, kMaxVertices> vertex;
  uint32_t count = 0;
  uint32_t end = kDark;
  float weight = 1;      ///< of the end; the vertices' light is weighted
  bool in_beam = false;  ///< it depends on where a beam lands
  Passage passage;
};

/// Two random numbers in [0, 1).
using Draw = std::array<float, 2>;

/// Direct light at a point by one shadow ray.
class OneLight {
 public:
  /// Of those of the lights, by number, that take part.
  OneLight(std::span<const trace::Light> lights, const std::function<bool(uint32_t)>& takes_part,
           uint32_t groups, uint64_t seed);
  /// A light by about its unshadowed share, half of all lights' and half within its group, so that
  /// no group is left out where others are dimmed. Suns that static things hide are left out.
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
  /// Goes on from the first hit, which is near. `key`: of the ray; `first`: for that hit.
  Chain trace(uint64_t key, const Draw& first, Vec3f origin, Vec3f w, const trace::Hit& hit) const;
  /// Ends at the first hit, in `cell`, which is far.
  Chain end(const Draw& first, Vec3f origin, Vec3f w, const trace::Hit& hit, uint32_t cell) const;

 private:
  void finish(const Draw& draw, const direct::Receiver& at, uint32_t material, uint32_t cell,
              Chain& chain) const;

  const Present& present_;
  const CellFinder& finder_;
  GuideColumns guides_;
  OneLight one_light_, one_beam_, one_sun_;
  uint64_t seed_;
};

}  // namespace deltalux::gather
