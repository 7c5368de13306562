// SPDX-License-Identifier: Apache-2.0
// Chooses the disc method for one part of a session: the cheapest by predicted time, or by the
// paper's rule of thumb.
#pragma once
#include <cstdint>
#include <vector>

#include "plan/pilot.h"

namespace deltalux::plan {

/// `paper_*`: disc index for static samples; for moving samples, the sphere cache if the object is
/// smaller than 35 % of the scene (paper, Theorem 2), by the radius of bounding spheres or the
/// diagonal of boxes.
enum class Policy : uint8_t { measured, paper_sphere, paper_box };
inline constexpr double kPaperSize = 0.35;

/// The segments that a part's method has to process.
struct Traffic {
  bool moving = false;
  SegmentSample sample;   ///< a sample of the segments of a bake, in the space of the discs
  Load bake;              ///< all segments, once
  Load frame;             ///< segments to add in a frame
  double removed = 0;     ///< segments to remove in a frame, relative to those to add
  double frames = 0;      ///< number of frames expected after the bake
  bool rebuilds = false;  ///< the estimator is rebuilt in every frame
  double size_by_sphere = 0, size_by_box = 0;  ///< of the moving object, relative to the scene
};

/// Predicted costs of one method for one part, in CPU seconds.
struct MethodPlan {
  Method method = Method::automatic;
  double build_seconds = 0, bake_seconds = 0;
  double frame_seconds = 0;  ///< without a rebuild
  double bytes = 0;
  Counts bake{}, frame{};
  /// False if a lower bound sufficed to see that the method cannot save a tenth; all figures are
  /// then such bounds.
  bool piloted = true;

  double seconds(double frames, bool rebuilds) const {
    return build_seconds + bake_seconds + frames * (frame_seconds + rebuilds * build_seconds);
  }
};

struct PartPlan {
  uint32_t object = 0xffffffffu;  ///< of a moving part
  Method chosen = Method::automatic;
  std::vector<MethodPlan> methods;  ///< empty if the user chose the method
  double discs = 0;
  Traffic traffic;  ///< without its sample
};

/// Plans one part. With `thorough`, every method runs its pilot; otherwise only those that may save
/// a tenth. Throws Cancelled.
PartPlan plan_part(Pilot& pilot, Traffic traffic, Policy policy, const Machine& machine,
                   bool thorough, Progress* progress = nullptr);

}  // namespace deltalux::plan
