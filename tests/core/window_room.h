// SPDX-License-Identifier: Apache-2.0
// A room with a window, for the tests of what is guided through it.
#pragma once
#include "direct_world.h"
#include "samples/sample_set.h"

namespace deltalux::plan {

/// Opposite corners of the window.
inline constexpr Vec3f kWindow[2] = {{1.3f, 1, 4}, {2.7f, 2, 4}};

/// 4 x 3 x 4 m from the origin on, of material 0; the window (opposite corners) is in the wall z
/// = 4.
inline void add_window_room(scene::Object& room, const Vec3f (&window)[2] = kWindow) {
  direct::add_quad(room, {0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  direct::add_quad(room, {0, 3, 0}, {4, 0, 0}, {0, 0, 4});
  direct::add_quad(room, {0, 0, 0}, {4, 0, 0}, {0, 3, 0});
  direct::add_quad(room, {0, 0, 0}, {0, 3, 0}, {0, 0, 4});
  direct::add_quad(room, {4, 0, 0}, {0, 0, 4}, {0, 3, 0});
  const float x[4] = {0, window[0].x, window[1].x, 4}, y[4] = {0, window[0].y, window[1].y, 3};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (i != 1 || k != 1)
        direct::add_quad(room, {x[i], y[k], 4}, {x[i + 1] - x[i], 0, 0}, {0, y[k + 1] - y[k], 0});
}

/// On the floor, the ceiling and the wall that faces the window.
inline samples::SampleSet samples_in_window_room() {
  samples::SampleSet samples;
  for (int i = 0; i < 400; ++i) {
    const float u = 0.1f + 0.2f * float(i % 20), v = 0.1f + 0.2f * float(i / 20);
    samples.point.insert(samples.point.end(), {{u, 0, v}, {u, 3, v}, {u, 0.75f * v, 0}});
    samples.normal.insert(samples.normal.end(), {{0, 1, 0}, {0, -1, 0}, {0, 0, 1}});
  }
  samples.radius.assign(samples.size(), 0.1f);
  samples.attached.assign(samples.size(), scene::kNone);
  return samples;
}

}  // namespace deltalux::plan
