// SPDX-License-Identifier: Apache-2.0
// The segment-disc test against geometry written down independently, in double precision.
#include "estimate/crossing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/random.h"

namespace deltalux::estimate {
namespace {

constexpr double kStep = 2 * std::numbers::pi / samples::kProbes;

TEST(Crossing, ProbeDirections) {
  for (int k = 0; k < samples::kProbes; ++k) {
    EXPECT_NEAR(kProbeDirections.cosine[k], std::cos(kStep * k), 6e-8);
    EXPECT_NEAR(kProbeDirections.sine[k], std::sin(kStep * k), 6e-8);
  }
}

TEST(Crossing, SectorsFollowTheAngle) {
  for (int i = 0; i < 100000; ++i) {
    const double turn = samples::kProbes * (i + 0.5) / 100000;
    if (std::fabs(turn - std::round(turn)) < 1e-5) continue;
    const float r = std::pow(10.0f, 12 * unit_float(mix64(uint64_t(i))) - 6);
    const float u = r * float(std::cos(kStep * turn)), v = r * float(std::sin(kStep * turn));
    ASSERT_EQ(sector_of(u, v), int(turn)) << "turn " << turn;
  }
}

/// Even-odd rule; also returns the distance to the nearest edge.
bool inside_polygon(const samples::Outline& outline, double u, double v, double& distance) {
  bool inside = false;
  distance = 1e30;
  for (int k = 0; k < samples::kProbes; ++k) {
    const int next = (k + 1) % samples::kProbes;
    const double ax = outline[k] * std::cos(kStep * k), ay = outline[k] * std::sin(kStep * k);
    const double bx = outline[next] * std::cos(kStep * next),
                 by = outline[next] * std::sin(kStep * next);
    if ((ay > v) != (by > v) && u < (bx - ax) * (v - ay) / (by - ay) + ax) inside = !inside;
    const double ex = bx - ax, ey = by - ay, e2 = ex * ex + ey * ey;
    double s = e2 > 0 ? ((u - ax) * ex + (v - ay) * ey) / e2 : 0;
    s = std::min(1.0, std::max(0.0, s));
    distance = std::min(distance, std::hypot(u - ax - s * ex, v - ay - s * ey));
  }
  return inside;
}

/// Within the outline of a disc of radius 1.
bool within(const samples::Outline& outline, float u, float v) {
  return inside_sector(outline, sector_of(u, v), 1.0f, u, v);
}

TEST(Crossing, OutlineIsAStarPolygon) {
  int inside = 0, outside = 0;
  for (uint64_t i = 0; i < 20000; ++i) {
    const auto draw = [&](uint64_t k) { return unit_float(combine(i, k)); };
    samples::Outline outline;
    for (int k = 0; k < samples::kProbes; ++k) outline[k] = 0.05f + 0.9f * draw(uint64_t(k));
    const float r = std::sqrt(draw(40)), phi = float(kStep) * samples::kProbes * draw(41);
    const float u = r * std::cos(phi), v = r * std::sin(phi);
    double distance;
    const bool expected = inside_polygon(outline, u, v, distance);
    if (distance < 1e-5) continue;
    ASSERT_EQ(within(outline, u, v), expected) << u << ", " << v;
    ++(expected ? inside : outside);
  }
  EXPECT_GT(inside, 1000);
  EXPECT_GT(outside, 1000);
}

TEST(Crossing, BetweenUnclippedProbesTheOutlineIsTheCircle) {
  samples::Outline outline;
  outline.fill(1.0f);
  for (int i = 0; i < 1000; ++i) {
    const float phi = 0.00628f * float(i);
    EXPECT_TRUE(within(outline, 0.9999f * std::cos(phi), 0.9999f * std::sin(phi)));
  }
  EXPECT_TRUE(within(outline, 0, 0));
  outline.fill(0.0f);
  EXPECT_FALSE(within(outline, 0.5f, 0.1f));
}

TEST(Crossing, OnlyFromTheFrontAndWithinTheSegment) {
  const Vec3f c{1, 2, 3}, n{0, 0, 1}, down{0, 0, -1}, up{0, 0, 1};
  EXPECT_TRUE(cross_circle({1, 2, 4}, down, 1.0f, c, n, 0.5f).hit) << "the end belongs to it";
  EXPECT_FALSE(cross_circle({1, 2, 4}, down, 0.999f, c, n, 0.5f).hit);
  EXPECT_FALSE(cross_circle({1, 2, 3}, down, 1.0f, c, n, 0.5f).hit) << "the origin does not";
  EXPECT_FALSE(cross_circle({1, 2, 2}, down, 1.0f, c, n, 0.5f).hit) << "behind the origin";
  EXPECT_FALSE(cross_circle({1, 2, 2}, up, 2.0f, c, n, 0.5f).hit) << "from the back";
  EXPECT_FALSE(cross_circle({1, 2, 3}, {1, 0, 0}, 2.0f, c, n, 0.5f).hit) << "in the plane";
  EXPECT_TRUE(cross_circle({1.5f, 2, 4}, down, 2.0f, c, n, 0.5f).hit) << "the rim belongs to it";
  EXPECT_FALSE(cross_circle({1.51f, 2, 4}, down, 2.0f, c, n, 0.5f).hit);
}

TEST(Crossing, SegmentEnds) {
  using segments::SegmentEnd;
  EXPECT_EQ(segment_end(SegmentEnd::first, 2, 5, 0.5f), 2);
  EXPECT_EQ(segment_end(SegmentEnd::second, 2, 5, 0.5f), 5);
  EXPECT_EQ(segment_end(SegmentEnd::bounded, 2, 5, 0.5f), 3.5f);
  EXPECT_EQ(segment_end(SegmentEnd::bounded, 2, 2.5f, 0.5f), 2.5f);
}

}  // namespace
}  // namespace deltalux::estimate
