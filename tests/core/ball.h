// SPDX-License-Identifier: Apache-2.0
// A ball to stand in, for closed forms.
#pragma once
#include <cmath>
#include <numbers>

#include "samples/sample_set.h"
#include "scene/scene.h"

namespace deltalux {

/// A ball of radius 1 about the origin, each of whose triangles has a stripe of its own.
inline scene::Object ball(int rings = 24) {
  scene::Object out;
  out.name = "ball";
  const int columns = 2 * rings;
  const auto at = [&](int ring, int column) {
    const double theta = std::numbers::pi * ring / rings,
                 phi = 2 * std::numbers::pi * column / columns;
    return Vec3f(
        Vec3d{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
  };
  const auto add = [&](Vec3f a, Vec3f b, Vec3f c) {
    const uint32_t first = uint32_t(out.vertices.size());
    out.vertices.insert(out.vertices.end(), {a, b, c});
    out.triangles.push_back({first, first + 1, first + 2});
    out.material.push_back(0), out.group.push_back(0);
    out.texture.push_back({{{0, 0.75f}, {1, 0.75f}, {0, 0.75f}}});
  };
  for (int i = 0; i < rings; ++i)
    for (int k = 0; k < columns; ++k) {
      if (i > 0) add(at(i, k), at(i + 1, k), at(i, k + 1));
      if (i + 1 < rings) add(at(i + 1, k), at(i + 1, k + 1), at(i, k + 1));
    }
  return out;
}

/// Samples in the middle of every `step`-th triangle of a ball, which face the inside.
inline samples::SampleSet inside(const scene::Object& ball, size_t step) {
  samples::SampleSet out;
  for (size_t t = 7; t < ball.triangles.size(); t += step) {
    Vec3f sum{};
    for (const uint32_t v : ball.triangles[t]) sum = sum + ball.vertices[v];
    out.point.push_back(sum * (1.0f / 3));
    out.normal.push_back(-normalize(sum));
    out.attached.push_back(scene::kNone);
    out.radius.push_back(0.05f);
  }
  return out;
}

}  // namespace deltalux
