// SPDX-License-Identifier: Apache-2.0
// Parts of meshes: together they hold the mesh wherever it is, and less space than its box.
#include "trace/parts.h"

#include <gtest/gtest.h>

#include "direct_world.h"
#include "session_world.h"

namespace deltalux::trace {
namespace {

/// A seat on four legs, of quads that stand upright.
scene::Object stool() {
  scene::Object stool;
  direct::add_quad(stool, {-0.2f, 0.45f, -0.2f}, {0, 0, 0.4f}, {0.4f, 0, 0}, 0);
  for (const float x : {-0.18f, 0.15f})
    for (const float z : {-0.18f, 0.15f}) {
      direct::add_quad(stool, {x, 0, z}, {0.03f, 0, 0}, {0, 0.45f, 0}, 0);
      direct::add_quad(stool, {x, 0, z}, {0, 0, 0.03f}, {0, 0.45f, 0}, 0);
    }
  return stool;
}

TEST(Parts, OfAStoolAreItsSeatAndItsLegs) {
  const scene::Object object = stool();
  const Parts parts(object.vertices, object.triangles);
  EXPECT_GE(parts.count(), 5u);
  Box whole;
  float sum = 0;
  for (const Box& box : parts.boxes(object.vertices, object.triangles)) {
    whole.grow(box);
    sum += box.half_area();
    EXPECT_TRUE(box.extent().y < 0.1f || box.extent().x < 0.1f) << "neither seat nor leg";
  }
  EXPECT_LT(sum, 0.7f * whole.half_area());
}

TEST(Parts, HoldTheirTrianglesWhereverTheyAre) {
  for (uint32_t round = 0; round < 50; ++round) {
    std::vector<Vec3f> vertices;
    std::vector<std::array<uint32_t, 3>> triangles;
    const uint32_t count = 1 + round * round % 300;
    for (uint32_t i = 0; i < count; ++i) {
      const auto p = sobol::sample(i, round), q = sobol::sample(i, round + 50);
      const Vec3f at{p[0], p[1], p[2]};
      triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
      for (const Vec3f& off : {Vec3f{}, Vec3f{q[0], q[1], 0}, Vec3f{0, q[2], q[3]}})
        vertices.push_back(at + off * 0.1f);
    }
    const Parts parts(vertices, triangles);
    ASSERT_GE(parts.count(), 1u);
    ASSERT_LE(parts.count(), Parts::kMost);
    Pose pose = session::at(3, -2);
    pose.row[0] = {0.6, 0, 0.8}, pose.row[2] = {-0.8, 0, 0.6};
    for (Vec3f& vertex : vertices) vertex = pose.point(vertex);
    const std::vector<Box> boxes = parts.boxes(vertices, triangles);
    for (const auto& corners : triangles) {
      Box own;
      for (const uint32_t corner : corners) own.grow(vertices[corner]);
      EXPECT_TRUE(std::any_of(boxes.begin(), boxes.end(),
                              [&](const Box& box) { return box.contains(own); }));
    }
  }
}

TEST(Parts, OfTrianglesInOnePlaceAreOne) {
  const std::vector<Vec3f> vertices{{0, 0, 0}, {1, 0, 0}, {1, 1, 1}, {0, 1, 1}};
  const std::vector<std::array<uint32_t, 3>> triangles{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}};
  EXPECT_EQ(Parts(vertices, triangles).count(), 1u);
}

TEST(Parts, OfNothingAreNone) { EXPECT_EQ(Parts({}, {}).count(), 0u); }

}  // namespace
}  // namespace deltalux::trace
