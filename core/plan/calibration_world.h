// SPDX-License-Identifier: Apache-2.0
// The worlds of the calibration: a unit cube with discs on its walls or inside, and chords.
#pragma once
#include "plan/counting.h"

namespace deltalux::plan {

/// Chords between random points of the walls, moved by `shift`.
SegmentSample make_chords(size_t count, Vec3f shift = {});
/// Discs of random directions inside the cube, of this radius.
samples::DiscSet scatter_in_volume(size_t count, float radius);
/// Discs on the walls that look inwards, so large that a chord crosses about `hits` of them.
samples::DiscSet scatter_on_walls(size_t count, float hits);

/// The same ones, but those with x below `x` clipped: each has an outline of its own, of which half
/// lies inside the circle.
samples::DiscSet clipped_below(float x, samples::DiscSet discs);
/// Discs on a ball in the middle, along a spiral: neighbours in memory are neighbours in space.
samples::DiscSet spread_on_ball(size_t count);

}  // namespace deltalux::plan
