// SPDX-License-Identifier: Apache-2.0
// Random points on the walls of the unit cube, and inside it.
#include "plan/calibration_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"

namespace deltalux::plan {
namespace {

constexpr float kWallArea = 6;

struct WallPoint {
  Vec3f place, inward;
};

WallPoint on_wall(const PathRandom& random, uint32_t draw) {
  const auto wall = std::min(5u, uint32_t(6 * random(draw, 0)));
  const uint32_t axis = wall % 3;
  const bool high = wall >= 3;
  WallPoint point{};
  point.place[axis] = high ? 1.0f : 0.0f;
  point.place[(axis + 1) % 3] = random(draw, 1);
  point.place[(axis + 2) % 3] = random(draw, 2);
  point.inward[axis] = high ? -1.0f : 1.0f;
  return point;
}

struct DiscBuilder {
  samples::DiscSet discs;
  void add(Vec3f centre, Vec3f normal, float radius) {
    discs.id.push_back(uint32_t(discs.size()));
    discs.centre.push_back(centre);
    discs.normal.push_back(normal);
    discs.radius.push_back(radius);
    discs.outline.push_back(samples::kWholeDisc);
  }
};

}  // namespace

SegmentSample make_chords(size_t count, Vec3f shift) {
  SegmentSample chords;
  for (size_t i = 0; i < count; ++i) {
    const PathRandom random(1, i);
    const Vec3f from = on_wall(random, 0).place, to = on_wall(random, 1).place;
    const float far = length(to - from);
    if (far > 0) chords.add(from + shift, (to - from) * (1 / far), far, far);
  }
  return chords;
}

samples::DiscSet scatter_in_volume(size_t count, float radius) {
  DiscBuilder built;
  for (size_t i = 0; i < count; ++i) {
    const PathRandom random(2, i);
    const float z = 2 * random(1, 0) - 1, phi = 2 * std::numbers::pi_v<float> * random(1, 1);
    const float flat = std::sqrt(std::max(0.0f, 1 - z * z));
    built.add({random(0, 0), random(0, 1), random(0, 2)},
              {flat * std::cos(phi), flat * std::sin(phi), z}, radius);
  }
  return std::move(built.discs);
}

samples::DiscSet scatter_on_walls(size_t count, float hits) {
  DiscBuilder built;
  const float radius =
      std::sqrt(hits * kWallArea / (std::numbers::pi_v<float> * float(std::max<size_t>(1, count))));
  for (size_t i = 0; i < count; ++i) {
    const WallPoint point = on_wall(PathRandom(3, i), 0);
    built.add(point.place, point.inward, radius);
  }
  return std::move(built.discs);
}

samples::DiscSet clipped_below(float x, samples::DiscSet discs) {
  for (size_t i = 0; i < discs.size(); ++i) {
    if (discs.centre[i].x >= x) continue;
    discs.outline[i] = uint32_t(discs.outlines.size());
    samples::Outline& outline = discs.outlines.emplace_back();
    for (int k = 0; k < samples::kProbes; ++k)
      outline[k] = discs.radius[i] * (k < samples::kProbes / 2 ? 1.0f : 0.5f);
  }
  return discs;
}

samples::DiscSet spread_on_ball(size_t count) {
  DiscBuilder built;
  const float radius = 0.4f, spacing = radius * std::sqrt(3.0f / float(count));
  for (size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * double(i) + 1) / double(count), flat = std::sqrt(1 - z * z);
    const double angle = std::sqrt(4 * std::numbers::pi * double(count)) * std::acos(z);
    const Vec3f outward{float(flat * std::cos(angle)), float(flat * std::sin(angle)), float(z)};
    built.add(Vec3f{0.5f, 0.5f, 0.5f} + outward * radius, outward, spacing);
  }
  return std::move(built.discs);
}

}  // namespace deltalux::plan
