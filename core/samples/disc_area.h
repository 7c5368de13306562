// SPDX-License-Identifier: Apache-2.0
// The part of a disc that its centre can reach in the tangent plane. It keeps discs from extending
// under walls, and division by its area corrects dark edges and corners.
//
// Discs are lifted off their surface by a small share of their radius. Then nothing lies between
// the disc and the room, so that the first hit is the right end of every segment, on flat, concave
// and convex surfaces alike, and gaps under objects that stand on a surface are not reached.
#pragma once
#include <span>

#include "base/parallel.h"
#include "base/progress.h"
#include "samples/disc_set.h"
#include "samples/sample_set.h"
#include "trace/ray_caster.h"

namespace deltalux::samples {

/// The lift of reachable discs, relative to the radius.
inline constexpr float kLift = 0.03f;

/// The geometry that samples lie on: the static scene, or one movable object in its local space.
struct Ground {
  const scene::Scene& scene;       ///< the whole scene
  const trace::RayCaster& caster;  ///< over the ground, as its static geometry
  uint32_t first_primitive = 0;    ///< index of the ground's first primitive
  Box world;                       ///< where segments end that hit nothing
};

/// Makes the discs of the samples `ids`, in the space of the ground, clipped by the ground and by
/// its world box.
DiscSet make_discs(const SampleSet& samples, std::vector<uint32_t> ids, DiscArea rule,
                   const Ground& ground, const Workers& workers, Progress& progress);

/// Scene::slack_of() of the surface that `point` lies on; 0 if there is none within `within`
/// metres.
float slack_under(const Ground& ground, Vec3f point, Vec3f normal, float within);

/// How far above `point` rays must start. Searches for the surface under the point within `within`
/// metres.
float rounding_above(const Ground& ground, Vec3f point, Vec3f normal, float within);

/// Points of a disc, distributed uniformly over the area within its outline.
class DiscPoints {
 public:
  DiscPoints(Vec3f normal, float radius, const Outline& outline);
  /// Maps three numbers in [0, 1) to a point; returns its offset from the centre.
  Vec3f operator()(float sector, float outward, float across) const;

 private:
  std::array<Vec3f, kProbes> end_;
  std::array<float, kProbes> area_;  // cumulative, including each sector
};

/// Area within the outline, in square metres.
float outline_area(const DiscSet& discs, size_t i);

/// Integrals of 1, p and p p^T over the outline, in the disc's own (u, v) frame.
struct OutlineMoments {
  double area = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0;
};
OutlineMoments outline_moments(const DiscSet& discs, size_t i);

/// Geometry that may cover a part of a disc and moves relative to it: closed movable objects, see
/// scene::Object.
struct ForeignGeometry {
  const trace::RayCaster* caster = nullptr;
  bool with_static = false;  ///< whether static geometry is foreign, too (for samples on movables)
  /// the object that the samples are attached to, which is never foreign
  uint32_t own_object = scene::kNone;
};
/// The outline's area minus the area that `foreign` geometry covers in the disc's plane. `pose`
/// transforms the disc to world space. A pure function of the scene's present state.
float uncovered_area(const DiscSet& discs, size_t i, const Pose& pose,
                     const ForeignGeometry& foreign);

}  // namespace deltalux::samples
