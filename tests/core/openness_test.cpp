// SPDX-License-Identifier: Apache-2.0
// Openness in a slit between two plates: falls inward, is 1 in the open and beside what emits.
#include "samples/openness.h"

#include <gtest/gtest.h>

#include "direct_world.h"
#include "samples/disc_area.h"

namespace deltalux::samples {
namespace {

constexpr float kHeight = 0.02f, kRadius = 0.1f;
const Vec3f kUp{0, 0, 1};

/// A floor of 4 m around the origin, and above its half x < 0 a plate of this material.
class Slit : public direct::World {
 public:
  explicit Slit(uint32_t material) {
    scene::Object object;
    direct::add_quad(object, {-2, -2, 0}, {4, 0, 0}, {0, 4, 0});
    direct::add_quad(object, {-2, -2, kHeight}, {0, 4, 0}, {2, 0, 0}, material);  // faces down
    scene.objects.push_back(object);
    finish();
  }
  /// Of a disc whole in its plane, x from the slit's mouth.
  float at(float x) const {
    Outline whole;
    whole.fill(kRadius);
    return relative_openness(scene, *caster, {x, 0, 0.5f * kHeight}, kUp, kRadius, whole);
  }
};

TEST(Openness, IsOneInTheOpen) {
  EXPECT_EQ(Slit(0).at(1), 1);
  EXPECT_EQ(Slit(0).at(0.5f), 1);
}

TEST(Openness, FallsIntoASlit) {
  const Slit slit(0);
  const float before = slit.at(-0.25f * kHeight), within = slit.at(-2 * kHeight),
              deep = slit.at(-4 * kHeight);
  EXPECT_LT(before, 1);
  EXPECT_LT(within, 0.5f * before);
  EXPECT_LT(deep, within);  // slower: the rest of the disc is deeper, too
}

TEST(Openness, NothingGetsDeepInside) {
  const Slit slit(0);
  EXPECT_EQ(slit.at(-1), 1);  // nor to any of the disc: no correction
}

TEST(Openness, WhatEmitsIsAsBrightAsTheSurroundings) { EXPECT_EQ(Slit(1).at(-2 * kHeight), 1); }

TEST(DiscPoints, AreUniformOverTheOutline) {
  Outline half;  // the half u > 0, in the frame of the normal
  half.fill(0);
  for (int k = 0; k < kProbes; ++k)
    if (k <= kProbes / 4 || k >= 3 * kProbes / 4) half[k] = kRadius;
  const DiscPoints points(kUp, kRadius, half);
  Vec3f u, v, sum{0, 0, 0};
  tangent_frame(kUp, u, v);
  constexpr int kSide = 32;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j)
      for (int k = 0; k < kSide; ++k) {
        const auto middle = [](int n) { return (float(n) + 0.5f) / kSide; };
        const Vec3f p = points(middle(i), middle(j), middle(k));
        EXPECT_GE(dot(p, u), -1e-6f);
        sum = sum + p * (1.0f / (kSide * kSide * kSide));
      }
  EXPECT_NEAR(dot(sum, u), 4 * kRadius / (3 * 3.14159265f), 0.01f * kRadius);  // centroid
  EXPECT_NEAR(dot(sum, v), 0, 0.01f * kRadius);
}

}  // namespace
}  // namespace deltalux::samples
