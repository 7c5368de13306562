// SPDX-License-Identifier: Apache-2.0
// Test scenes of the calibration: a unit cube with discs on its walls or inside, and chords.
#pragma once
#include "plan/counting.h"

namespace deltalux::plan {

/// Chords between random points of the walls, translated by `shift`.
SegmentSample make_chords(size_t count, Vec3f shift = {});
/// Discs with random normals inside the cube, of the given radius.
samples::DiscSet scatter_in_volume(size_t count, float radius);
/// Discs on the walls, facing inwards, so large that a chord crosses about `hits` of them.
samples::DiscSet scatter_on_walls(size_t count, float hits);

/// The same discs; those with an x coordinate below `x` are clipped: each gets an outline of its
/// own, half of which lies inside the circle.
samples::DiscSet clipped_below(float x, samples::DiscSet discs);
/// Discs on a ball in the middle, along a spiral: neighbours in memory are neighbours in space.
samples::DiscSet spread_on_ball(size_t count);

}  // namespace deltalux::plan
