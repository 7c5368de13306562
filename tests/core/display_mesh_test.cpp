// SPDX-License-Identifier: Apache-2.0
// What display meshes are made of: edges, places, subdivision, smooth vertices, groups in cubes.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "samples/components.h"
#include "samples/contact_lines.h"
#include "samples/cube_groups.h"
#include "samples/mesh_edges.h"
#include "samples/places.h"
#include "samples/sharing.h"
#include "samples/smooth_vertices.h"
#include "samples/subdivision.h"
#include "samples/triangle_shapes.h"

namespace deltalux::samples {
namespace {

using Numbers = std::vector<int64_t>;

/// A square of 1 m of two triangles that meet at the edge from 0 to 2.
const std::vector<Vec3d> kSquare{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const std::vector<Triangle> kHalves{{0, 1, 2}, {0, 2, 3}};

TEST(Components, AreNumberedByTheirFirstThings) {
  const Numbers one{4, 5, 1}, two{2, 3, 5};
  EXPECT_EQ(connected_components(one, two, 7), (std::vector<int32_t>{0, 1, 2, 1, 2, 1, 3}));
  EXPECT_TRUE(connected_components({}, {}, 0).empty());
}

TEST(MeshEdges, NeighboursRunInOppositeDirections) {
  const auto [one, two] = shared_edges(kHalves, 4);
  EXPECT_EQ(one, Numbers{2});  // from 2 to 0
  EXPECT_EQ(two, Numbers{3});  // from 0 to 2
  const std::vector<Triangle> against{{0, 1, 2}, {0, 3, 2}};
  EXPECT_TRUE(shared_edges(against, 4).first.empty());
}

TEST(MeshEdges, EveryPairOfThreeSheetsIsLookedAt) {
  // Edges from 0 to 1 have the numbers 0 and 6, the one back has 3.
  const std::vector<Triangle> sheets{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  const auto [one, two] = shared_edges(sheets, 5);
  EXPECT_EQ(one, (Numbers{0, 3}));
  EXPECT_EQ(two, (Numbers{3, 6}));
  const std::vector<Triangle> apart{{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
  EXPECT_EQ(shared_edges(apart, 5).first, (Numbers{3, 0}));  // neighbours come first
  EXPECT_EQ(shared_edges(apart, 5).second, (Numbers{6, 6}));
}

TEST(MeshEdges, ThreeTrianglesMakeAJunction) {
  const std::vector<Vec3d> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  const std::vector<Triangle> sheets{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  EXPECT_EQ(junctions(points, sheets, 0.9), (std::vector<uint8_t>{1, 0, 0, 1, 0, 0, 1, 0, 0}));
  EXPECT_EQ(junctions(points, sheets, 1.1), std::vector<uint8_t>(9));
  const std::vector<Triangle> both{{0, 1, 2}, {1, 0, 2}, {0, 1, 4}};  // two windings count once
  EXPECT_EQ(junctions(points, both, 0.9), std::vector<uint8_t>(9));
}

TEST(MeshEdges, TrianglesAreRepeatedInAnyOrder) {
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 1, 3}, {2, 0, 1}, {1, 0, 2}, {3, 2, 1}};
  EXPECT_EQ(repeated_triangles(triangles, 4), (std::vector<uint8_t>{0, 0, 1, 1, 0}));
}

TEST(Places, AreThoseOfTheFirstPoint) {
  const double off = 1e-9;
  const std::vector<Vec3d> points{{1, 0, 0}, {-1, 0, 0}, {1 - off, off, 0}, {-1, 0, 1e-3}};
  EXPECT_EQ(same_places(points, 0x1p-20), (Numbers{0, 1, 0, 3}));
  EXPECT_TRUE(same_places({}, 0x1p-20).empty());
}

TEST(Places, BodiesKeepTheirsApart) {
  const std::vector<Vec3d> points{{1, 0, 0}, {-1, 0, 0}, {1, 1e-9, 0}, {1, 0, 0}, {0, 5, 0}};
  const Numbers first{0, 3, 5};
  const auto [representative, position] = welded_points(points, first, 0x1p-20);
  EXPECT_EQ(representative, (Numbers{1, 0, 4, 3}));  // by x
  EXPECT_EQ(position, (Numbers{1, 0, 1, 3, 2}));
}

TEST(Subdivision, LongEdgesAreHalvedOnBothSides) {
  const auto split = split_long_edges(kSquare, kHalves, 1.1 * 1.1, 100);  // the diagonal alone
  ASSERT_TRUE(split);
  EXPECT_EQ(split->added, (std::vector<Vec3d>{{0.5, 0.5, 0}}));
  EXPECT_EQ(split->pieces.triangles,
            (std::vector<Triangle>{{2, 4, 1}, {4, 0, 1}, {0, 4, 3}, {4, 2, 3}}));
  EXPECT_EQ(split->pieces.source, (Numbers{0, 0, 1, 1}));
}

TEST(Subdivision, CountsWhatItAdds) {
  for (const double limit : {0.3, 0.6, 1.1, 2.0}) {
    const auto split = split_long_edges(kSquare, kHalves, limit * limit, 1000);
    ASSERT_TRUE(split);
    EXPECT_EQ(count_halved_edges(kSquare, kHalves, limit * limit, 1000), split->added.size());
    const size_t all = kSquare.size() + split->added.size();
    EXPECT_TRUE(count_halved_edges(kSquare, kHalves, limit * limit, all));
    EXPECT_TRUE(split_long_edges(kSquare, kHalves, limit * limit, all));
    if (split->added.empty()) continue;
    EXPECT_FALSE(count_halved_edges(kSquare, kHalves, limit * limit, all - 1));
    EXPECT_FALSE(split_long_edges(kSquare, kHalves, limit * limit, all - 1));
  }
}

TEST(Subdivision, PartsCoverTheTriangleForEveryMark) {
  std::vector<Vec3d> points{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 0.5, 0}, {0, 0.5, 0}};
  const std::vector<Triangle> triangle{{0, 1, 2}};
  for (int bits = 1; bits < 8; ++bits) {
    Marks marks;
    Triangle middle{-1, -1, -1};
    for (size_t k = 0; k < 3; ++k)
      if ((marks[k] = bits >> k & 1)) middle[k] = int64_t(3 + k);
    const Pieces parts =
        split_marked(points, triangle, Numbers{7}, std::vector{marks}, std::vector{middle});
    const size_t marked = size_t(marks[0] + marks[1] + marks[2]);
    EXPECT_EQ(parts.source, Numbers(marked + 1, 7));
    double area = 0;
    for (const Vec3d& normal : normals_by_area(points, parts.triangles)) {
      EXPECT_GT(normal.z, 0);  // wound as before
      area += 0.5 * normal.z;
    }
    EXPECT_DOUBLE_EQ(area, 1);
  }
}

/// The square with its second half turned up by `angle` around the diagonal.
SmoothVertices folded(double angle, double smooth, bool part, bool covered) {
  const double half = std::sqrt(0.5);
  const Vec3d middle{0.5, 0.5, 0}, aside{-half, half, 0};
  std::vector<Vec3d> points = kSquare;
  points[3] = middle + aside * (half * std::cos(angle)) + Vec3d{0, 0, half * std::sin(angle)};
  const std::vector<double> cosine(2, std::cos(smooth));
  std::vector<uint8_t> parted(6), beside(6);
  parted[2] = part, beside[0] = covered;
  return *smooth_vertices({points, kHalves, cosine, parted, beside}, 0.1, 0.4, 100);
}

TEST(SmoothVertices, JoinCornersOfOneSurface) {
  const double flat = 0.1, degree = std::numbers::pi / 180;
  EXPECT_EQ(folded(flat, 30 * degree, false, false).of_corner, (Numbers{0, 1, 2, 0, 2, 3}));
  EXPECT_EQ(folded(flat, 1 * degree, false, false).of_corner, (Numbers{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(folded(flat, 30 * degree, true, false).of_corner, (Numbers{0, 1, 2, 3, 4, 5}));
}

TEST(SmoothVertices, NormalsAreMeansByAngle) {
  const SmoothVertices vertices = folded(0.2, 1, false, false);
  // Both corners at the fold are of 45 degrees: the normal lies half way.
  EXPECT_NEAR(vertices.normal[0].z, std::cos(0.1), 1e-12);
  EXPECT_EQ(vertices.normal[1], (Vec3d{0, 0, 1}));
  EXPECT_NEAR(length(vertices.normal[3]), 1, 1e-15);
}

TEST(SmoothVertices, SamplesMoveIntoTheFacesAround) {
  const SmoothVertices vertices = folded(0, 1, false, false);
  const double half = std::sqrt(0.5);
  // A quarter of a turn is open at corner 1: half way into it, no farther than 0.1 m.
  EXPECT_NEAR(vertices.inset[1].x, -0.1 * half, 1e-12);
  EXPECT_NEAR(vertices.inset[1].y, 0.1 * half, 1e-12);
  const SmoothVertices aside = folded(0, 1, false, true);  // the edge from 0 to 1 is covered
  EXPECT_LT(aside.inset[0].y / aside.inset[0].x, 0.5);     // into the first half alone
}

TEST(SmoothVertices, AreNoneWhereTheyWouldBeTooMany) {
  const std::vector<double> cosine(2, 0.5);
  const std::vector<uint8_t> none(6);
  const ShadedMesh mesh{kSquare, kHalves, cosine, none, none};
  EXPECT_TRUE(smooth_vertices(mesh, 0.1, 0.4, 4));
  EXPECT_FALSE(smooth_vertices(mesh, 0.1, 0.4, 3));
}

TEST(CubeGroups, StayInOneCubeAndKind) {
  const std::vector<Vec3d> vertices{{0.1, 0, 0}, {0.4, 0, 0}, {0.2, 0.3, 0}, {1.1, 0.1, 0}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {1, 3, 2}};
  const auto groups = [&](const Numbers& kind, double offset) {
    return groups_in_cubes(vertices, triangles, kind, 1, offset);
  };
  EXPECT_EQ(groups({5, 5, 5, 5}, 0), (std::vector<int32_t>{0, 0, 0, 1}));
  EXPECT_EQ(groups({5, 6, 5, 5}, 0), (std::vector<int32_t>{0, 1, 0, 2}));
  EXPECT_EQ(groups({5, 5, 5, 5}, 0.7), (std::vector<int32_t>{0, 1, 2, 1}));
}

TEST(Sharing, TakesTheVertexNearestToTheCentroid) {
  const std::vector<Vec3d> points{{0, 0, 0}, {5, 0, 0}, {1, 0, 0}, {2, 0, 0}, {7, 0, 0}};
  EXPECT_EQ(centroid_vertices(points, Numbers{0, 1, 0, 0, 1}), (Numbers{2, 1}));
}

TEST(Sharing, WeightsSamplesOfTheSameSurface) {
  // A strip of vertices 0 to 9, 1 m apart, with a row beside it; groups of two, samples at even
  // ones.
  std::vector<Vec3d> points, normals(20, Vec3d{0, 0, 1});
  Numbers kind(20), group, vertex;
  std::vector<Triangle> triangles;
  for (int64_t i = 0; i < 20; ++i) {
    points.push_back({double(i % 10), double(i / 10), 0});
    group.push_back(i % 10 / 2 + i / 10 * 5);
    if (i % 2 == 0) vertex.push_back(i);
    if (i % 10 < 9 && i < 10) triangles.push_back({i, i + 1, i + 10});
  }
  const std::vector<std::array<int64_t, 4>> near{{0, 1, 2, 3}};
  const auto of = [&](double reach) {
    const Numbers others{3};
    return shared_weights({points, normals, triangles, kind, group, vertex}, others, near,
                          {1, reach, 0.7, 0.5}, Workers(1));
  };
  // Vertex 3 of group 1, whose sample 1 replaces the last one; 2 m away is beyond reach.
  EXPECT_EQ(of(2).samples[0], (std::array<int32_t, 4>{0, 1, 1, 2}));
  EXPECT_EQ(of(2).weights[0], (std::array<float, 4>{0, 0.5f, 0, 0.5f}));
  // At 3 m the bound is 3.5, at 1 m 1.5.
  const double far = 1 / (3.5 * 3.5), close = 1 / (1.5 * 1.5), all = far + 2 * close;
  EXPECT_FLOAT_EQ(of(4).weights[0][0], float(far / all));
  EXPECT_FLOAT_EQ(of(4).weights[0][3], float(close / all));
  // The group's own sample serves alone where none is within reach,
  EXPECT_EQ(of(0.5).weights[0], (std::array<float, 4>{0, 1, 0, 0}));
  // and samples of another kind, of another direction, or far along the mesh do not.
  kind[4] = 1;
  EXPECT_EQ(of(2).weights[0], (std::array<float, 4>{0, 1, 0, 0}));
  kind[4] = 0, normals[4] = {1, 0, 0};
  EXPECT_EQ(of(2).weights[0], (std::array<float, 4>{0, 1, 0, 0}));
  normals[4] = {0, 0, 1};
  std::erase_if(triangles, [](const Triangle& t) { return t[0] == 3; });
  EXPECT_EQ(of(2).weights[0], (std::array<float, 4>{0, 1, 0, 0}));
}

TEST(TriangleShapes, TellAreaAndWidth) {
  const std::vector<Vec3d> points{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1e-10, 0}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 1, 3}};
  EXPECT_EQ(normals_by_area(points, triangles)[0], (Vec3d{0, 0, 2}));
  EXPECT_EQ(areas(points, triangles)[0], 1);
  EXPECT_EQ(without_area(points, triangles), (std::vector<uint8_t>{0, 1}));
  const double height = 2 / std::sqrt(5.0);
  EXPECT_EQ(wide_triangles(points, triangles, 2.2, 0.99 * height), (std::vector<uint8_t>{1, 0}));
  EXPECT_EQ(wide_triangles(points, triangles, 2.2, 1.01 * height), (std::vector<uint8_t>{0, 0}));
  EXPECT_EQ(wide_triangles(points, triangles, 2.3, 0), (std::vector<uint8_t>{0, 0}));
}

TEST(ContactLines, RunWhereAFaceStandsOnAPiece) {
  // A wall on the first half of the square, and one far away.
  std::vector<Vec3d> points = kSquare;
  for (const Vec3d p : {Vec3d{0.5, 0.1, 0}, Vec3d{0.9, 0.1, 0}, Vec3d{0.7, 0.1, 1},
                        Vec3d{0.5, 0.1, 5}, Vec3d{0.9, 0.1, 5}, Vec3d{0.7, 0.1, 6}})
    points.push_back(p);
  const std::vector<Triangle> pieces{kHalves[1], kHalves[0]};
  const Numbers face_of{1, 0};
  const std::vector<Triangle> faces{kHalves[0], kHalves[1], {4, 5, 6}, {7, 8, 9}};
  const auto lines =
      find_contact_lines(points, {pieces, face_of}, {faces, faces}, 0.01, 0.01, Workers(1));
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].piece, 1u);
  EXPECT_NEAR(lines[0].length, 0.4, 1e-12);
  EXPECT_NEAR(lines[0].start.y, 0.1, 1e-12);
  EXPECT_NEAR(std::fabs(lines[0].along.x), 1, 1e-12);
  for (const int threads : {2, 4})
    EXPECT_EQ(
        find_contact_lines(points, {pieces, face_of}, {faces, faces}, 0.01, 0.01, Workers(threads))
            .size(),
        1u);
}

}  // namespace
}  // namespace deltalux::samples
