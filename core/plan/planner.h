// SPDX-License-Identifier: Apache-2.0
// Chooses the disc method of one part of a session: the cheapest by predicted time, or by the
// paper's rule of thumb.
#pragma once
#include <cstdint>
#include <vector>

#include "plan/pilot.h"

namespace deltalux::plan {

/// `paper_*`: disc index for static samples; for moving ones the sphere cache below 35 % of the
/// scene (paper, Theorem 2), by the radius of the spheres or the diagonal of the boxes.
enum class Policy : uint8_t { measured, paper_sphere, paper_box };
inline constexpr double kPaperSize = 0.35;

/// What one part of a session brings to its method.
struct Traffic {
  bool moving = false;
  SegmentSample sample;   ///< of the segments of a bake, in the space of the discs
  Load bake;              ///< all segments, once
  Load frame;             ///< segments to add in a frame
  double removed = 0;     ///< segments to take away in a frame, as a share of those to add
  double frames = 0;      ///< that are expected after the bake
  bool rebuilds = false;  ///< the estimator is made anew in every frame
  double size_by_sphere = 0, size_by_box = 0;  ///< of the moving object, the scene being 1
};

/// One method on one part, processor seconds.
struct MethodPlan {
  Method method = Method::automatic;
  double build_seconds = 0, bake_seconds = 0;
  double frame_seconds = 0;  ///< without a rebuild
  double bytes = 0;
  Counts bake{}, frame{};
  /// False where a lower bound was enough to see that the method cannot save a tenth: then all
  /// figures are such bounds.
  bool piloted = true;

  double seconds(double frames, bool rebuilds) const {
    return build_seconds + bake_seconds + frames * (frame_seconds + rebuilds * build_seconds);
  }
};

struct PartPlan {
  uint32_t object = 0xffffffffu;  ///< of a moving part
  Method chosen = Method::automatic;
  std::vector<MethodPlan> methods;  ///< empty where the user named the method
  double discs = 0;
  Traffic traffic;  ///< less its sample
};

/// With `thorough` every method runs its pilot, else only those that may save a tenth beside the
/// others. Throws Cancelled.
PartPlan plan_part(Pilot& pilot, Traffic traffic, Policy policy, const Machine& machine,
                   bool thorough, Progress* progress = nullptr);

}  // namespace deltalux::plan
