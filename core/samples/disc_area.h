// SPDX-License-Identifier: Apache-2.0
// The part of a disc that its centre reaches in the tangent plane: it keeps
// discs from reaching under walls, and its area repairs dark edges and corners.
//
// Discs are lifted off their surface by a small share of their radius. Then nothing lies between
// the disc and the room, so the first hit is the right end of every segment, on flat, concave and
// convex surfaces alike, and gaps under objects that stand on a surface do not count as reach.
#pragma once
#include <span>

#include "base/parallel.h"
#include "base/progress.h"
#include "samples/disc_set.h"
#include "samples/sample_set.h"
#include "trace/ray_caster.h"

namespace deltalux::samples {

/// Share of the radius by which reachable discs are lifted.
inline constexpr float kLift = 0.03f;

/// What samples lie on: the static scene, or one movable object, in whose own space its samples
/// are.
struct Ground {
  const scene::Scene& scene;       ///< the whole one
  const trace::RayCaster& caster;  ///< its static geometry is the ground
  uint32_t first_primitive = 0;    ///< of the ground
  Box world;                       ///< where segments that hit nothing end
};

/// Discs of the samples listed in `ids`, in their own space, clipped by the ground and its world.
DiscSet make_discs(const SampleSet& samples, std::vector<uint32_t> ids, DiscArea rule,
                   const Ground& ground, const Workers& workers, Progress& progress);

/// How far above `point` on the ground rays must begin; looks for a surface `within` metres.
float rounding_above(const Ground& ground, Vec3f point, Vec3f normal, float within);

/// Points of a disc, uniform over what its outline leaves of it.
class DiscPoints {
 public:
  DiscPoints(Vec3f normal, float radius, const Outline& outline);
  /// Offset from the centre of the point of three numbers in [0, 1).
  Vec3f operator()(float sector, float outward, float across) const;

 private:
  std::array<Vec3f, kProbes> end_;
  std::array<float, kProbes> area_;  // up to and with each sector
};

/// Area inside the outline, square metres.
float outline_area(const DiscSet& discs, size_t i);

/// Integrals over the outline in the disc's own (u, v) frame: 1, p, p p^T.
struct OutlineMoments {
  double area = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0;
};
OutlineMoments outline_moments(const DiscSet& discs, size_t i);

/// Geometry that may cover part of a disc and moves relative to it: closed movables, see
/// scene::Object.
struct ForeignGeometry {
  const trace::RayCaster* caster = nullptr;
  bool with_static = false;            ///< static geometry is foreign too (moving samples)
  uint32_t own_object = scene::kNone;  ///< never foreign
};
/// The outline's area less what `foreign` geometry covers in the disc's plane. `pose` takes the
/// disc to world space. A pure function of the state of the scene.
float uncovered_area(const DiscSet& discs, size_t i, const Pose& pose,
                     const ForeignGeometry& foreign);

}  // namespace deltalux::samples
