// SPDX-License-Identifier: Apache-2.0
// Cells: every point of a surface has one, of the area that its share of the surface says; walls
// part them; they follow their body.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>
#include <vector>

#include "base/fault.h"
#include "base/random.h"
#include "direct_world.h"
#include "gather/cells/cells.h"
#include "gather/cells/coverage.h"

namespace deltalux::gather {
namespace {

using Triangle = BodyCells::Triangle;

/// Triangles of `object` in its own space.
std::vector<Triangle> triangles_of(const scene::Object& object) {
  std::vector<Triangle> out;
  for (size_t t = 0; t < object.triangles.size(); ++t) {
    Triangle triangle{{}, object.material[t]};
    for (int k = 0; k < 3; ++k)
      triangle.corner[k] = object.vertices[object.triangles[t][size_t(k)]];
    out.push_back(triangle);
  }
  return out;
}

/// Two triangles of material 0 for each mesh of a grid whose nodes are at(i, j).
template <class At>
void add_grid(scene::Object& object, int rows, int columns, const At& at) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const uint32_t base = uint32_t(object.vertices.size());
      object.vertices.insert(object.vertices.end(),
                             {at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
      object.triangles.insert(object.triangles.end(),
                              {{base, base + 1, base + 2}, {base, base + 2, base + 3}});
      object.material.insert(object.material.end(), 2, 0);
    }
}

double area_of(const Triangle& t) {
  return 0.5 * length(cross(Vec3d(t.corner[1] - t.corner[0]), Vec3d(t.corner[2] - t.corner[0])));
}

Vec3f normal_of(const Triangle& t) {
  return Vec3f(
      normalize(cross(Vec3d(t.corner[1] - t.corner[0]), Vec3d(t.corner[2] - t.corner[0]))));
}

Vec3f point_on(const Triangle& t, float a, float b) {
  if (a + b > 1) a = 1 - a, b = 1 - b;
  return t.corner[0] + (t.corner[1] - t.corner[0]) * a + (t.corner[2] - t.corner[0]) * b;
}

/// Points spread evenly over all triangles, 400 per square of `edge`; hits per cell of the front.
std::vector<double> counted(const std::vector<Triangle>& triangles, const BodyCells& cells,
                            float edge) {
  std::vector<double> found(cells.size());
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    const double area = area_of(triangles[t]);
    const uint32_t count = uint32_t(400 * area / (edge * edge)) + 16;
    for (uint32_t i = 0; i < count; ++i) {
      const auto r = sobol::sample(i, t + 1);
      const uint32_t cell =
          cells.find(t, point_on(triangles[t], r[0], r[1]), -normal_of(triangles[t]));
      if (cell == kNoCell) {
        ADD_FAILURE() << "a point without a cell";
        return found;
      }
      found[cell] += area / count;
    }
  }
  return found;
}

/// Each cell has the area that falls to it, all cells that of the surface.
void expect_areas(const std::vector<Triangle>& triangles, float edge) {
  const BodyCells cells(triangles, edge);
  double surface = 0, both = 0;
  for (const Triangle& t : triangles) surface += area_of(t);
  for (float area : cells.areas()) both += area;
  EXPECT_NEAR(both, 2 * surface, 1e-4 * surface);
  const std::vector<double> found = counted(triangles, cells, edge);
  for (uint32_t cell = 0; cell < cells.size(); ++cell) {
    if (found[cell] == 0) continue;  // a back, or less than a point of it
    EXPECT_NEAR(found[cell], cells.areas()[cell], 0.1 * cells.areas()[cell] + 0.01 * edge * edge)
        << cell;
  }
}

TEST(Cells, HaveTheAreaThatFallsToThem) {
  scene::Object plane, turned, pieces;
  direct::add_quad(plane, {0, 0, 0}, {3.1f, 0, 0}, {0, 0, -2.3f});
  expect_areas(triangles_of(plane), 0.2f);
  direct::add_quad(turned, {5, 1, 2}, {1.7f, 0.4f, -0.3f}, {0.2f, 1.1f, 0.9f});
  expect_areas(triangles_of(turned), 0.2f);
  direct::add_quad(pieces, {0, 0, 0}, {3, 0, 0}, {0, 0, -3}, 0, 41);
  expect_areas(triangles_of(pieces), 0.2f);
  expect_areas({{{{0, 0, 0}, {8, 0, 0}, {0, 0, -0.01f}}, 0}}, 0.2f);
  expect_areas({{{{0, 0, 0}, {2, 0.1f, 0}, {0.7f, 0.4f, 1.9f}}, 0}}, 0.2f);
}

TEST(Cells, AreDividedUntilCancelled) {
  scene::Object plane;
  direct::add_quad(plane, {0, 0, 0}, {3, 0, 0}, {0, 0, -3}, 0, 41);
  const auto triangles = triangles_of(plane);
  int checks = 0;
  for (bool done = false; !done; ++checks) {
    fault::arm(fault::Kind::cancel, checks + 1);
    try {
      const BodyCells cells(triangles, 0.05f);
      done = true;
    } catch (const Cancelled&) {
    }
  }
  fault::arm(fault::Kind::cancel, 0);
  EXPECT_GT(checks, 10);
}

TEST(Cells, OfOneSquareBelongToBothTrianglesOfAQuad) {
  scene::Object plane;
  direct::add_quad(plane, {0, 0, 0}, {2, 0, 0}, {0, 0, -2});
  const BodyCells cells(triangles_of(plane), 0.2f);
  EXPECT_EQ(cells.size(), 2u * 10 * 10);
  EXPECT_EQ(cells.find(0, {0.51f, 0, -0.5f}, {0, -1, 0}),
            cells.find(1, {0.5f, 0, -0.51f}, {0, -1, 0}));
  EXPECT_NE(cells.find(0, {0.51f, 0, -0.5f}, {0, -1, 0}),
            cells.find(0, {0.51f, 0, -0.5f}, {0, 1, 0}));
}

TEST(Cells, ArePartedByAWallThatStandsOnThem) {
  // A wall of one polygon across a floor that runs through under it, off the squares' borders.
  scene::Object object;
  direct::add_quad(object, {0, 0, 0}, {4, 0, 0}, {0, 0, -4});
  direct::add_quad(object, {1.93f, 0, 0}, {0, 0, -4}, {0, 2, 0});
  const auto triangles = triangles_of(object);
  const BodyCells cells(triangles, 0.2f);
  const Vec3f down{0, -1, 0};
  for (uint32_t i = 0; i < 1000; ++i) {
    const auto r = sobol::sample(i, 3);
    const Vec3f p{1.9f + 0.06f * r[0], 0, -4 * r[1]};
    const uint32_t own = cells.find(0, p, down);
    for (float x : {1.8f, 2.1f}) {
      const bool same_side = (x < 1.93f) == (p.x < 1.93f);
      EXPECT_TRUE(same_side || own != cells.find(0, {x, 0, p.z}, down));
    }
    const uint32_t left = cells.find(0, {1.92f, 0, p.z}, down);
    const uint32_t right = cells.find(0, {1.94f, 0, p.z}, down);
    EXPECT_NE(left, right);
    EXPECT_EQ(own, p.x < 1.93f ? left : right) << p.x;
  }
  // Below, where nothing stands, they are whole.
  EXPECT_EQ(cells.find(0, {1.92f, 0, -1}, {0, 1, 0}), cells.find(0, {1.94f, 0, -1}, {0, 1, 0}));
  expect_areas(triangles, 0.2f);
}

/// Adds the walls of a room that end at its corner, which is at (x, 0, z).
void add_corner(scene::Object& object, float x, float z) {
  direct::add_quad(object, {x, -0.5f, z}, {0, 0, -2}, {0, 2, 0});
  direct::add_quad(object, {x, -0.5f, z}, {-2, 0, 0}, {0, 2, 0});
}

/// Expects that no cell of the floor lies on both sides of the walls of add_corner().
/// `margin`: how near to the walls that is allowed. `triangle_at`: the triangle of the floor at a
/// point; `height_at`: its height there.
template <class Find, class Height>
void expect_parted(const scene::Object& object, float x, float z, float margin,
                   const Find& triangle_at, const Height& height_at) {
  const BodyCells cells(triangles_of(object), 0.16f);
  std::set<uint32_t> inside, outside;
  for (uint32_t i = 0; i < 4000; ++i) {
    const auto r = sobol::sample(i, 3);
    Vec3f p{x - 0.3f + 0.6f * r[0], 0, z - 0.3f + 0.6f * r[1]};
    if (std::fabs(p.x - x) < margin || std::fabs(p.z - z) < margin) continue;
    p.y = height_at(p);
    (p.x < x && p.z < z ? inside : outside).insert(cells.find(triangle_at(p), p, {0, -1, 0}));
  }
  for (const uint32_t cell : inside) EXPECT_FALSE(outside.contains(cell)) << x << ", " << z;
}

TEST(Cells, ArePartedAtTheCornerOfARoom) {
  // The floor's squares lie aslant: few centimetres of a wall may cross a square's corner.
  for (uint32_t k = 0; k < 40; ++k) {
    const auto shift = sobol::sample(k, 5);
    const float x = 0.3f * shift[0], z = 0.3f * shift[1];
    scene::Object object;
    direct::add_quad(object, {0, 0, -4}, {4, 0, 4}, {-4, 0, 4});
    add_corner(object, x, z);
    // The quad's triangles are those of x > 0 and x < 0. Cuts at a square's border are ignored.
    expect_parted(
        object, x, z, 0.002f, [](Vec3f p) { return p.x > 0 ? 0u : 1u; },
        [](Vec3f) { return 0.0f; });
  }
}

TEST(Cells, OfSmallTrianglesArePartedAtTheCornerOfARoom) {
  constexpr int kSide = 32;
  constexpr float kStep = 0.05f, kFirst = -0.6f;
  const auto height = [](int i, int j) { return 0.01f * std::sin(float(7 * i + 3 * j)); };
  const auto node = [&](int i, int j) {
    return Vec3f{kFirst + kStep * float(i), height(i, j), kFirst + kStep * float(j)};
  };
  for (uint32_t k = 0; k < 40; ++k) {
    const auto shift = sobol::sample(k, 5);
    const float x = 0.3f * shift[0], z = 0.3f * shift[1];
    scene::Object object;
    add_grid(object, kSide, kSide, node);
    add_corner(object, x, z);
    const auto place = [&](Vec3f p) {
      const float u = (p.x - kFirst) / kStep, v = (p.z - kFirst) / kStep;
      return std::tuple{int(u), int(v), u - std::floor(u), v - std::floor(v)};
    };
    // Walls that cross less than a twentieth of a clump do not cut it.
    expect_parted(
        object, x, z, 0.012f,
        [&](Vec3f p) {
          const auto [i, j, u, v] = place(p);
          return uint32_t(2 * (i * kSide + j) + (v > u ? 0 : 1));
        },
        [&](Vec3f p) {
          const auto [i, j, u, v] = place(p);
          const float from = height(i, j), to = height(i + 1, j + 1);
          return v > u ? from + (height(i, j + 1) - from) * (v - u) + (to - from) * u
                       : from + (height(i + 1, j) - from) * (u - v) + (to - from) * v;
        });
  }
}

TEST(Cells, OfSmallTrianglesAreFewAndParted) {
  // A ball of 5 cm with 2,000 triangles: cells by direction, each some part of it.
  scene::Object ball;
  constexpr int kRings = 32, kSpokes = 32;
  const auto at = [](int ring, int spoke) {
    const double theta = M_PI * ring / kRings, phi = 2 * M_PI * spoke / kSpokes;
    return Vec3f(
        Vec3d{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)} *
        0.05);
  };
  add_grid(ball, kRings, kSpokes, at);
  const BodyCells cells(triangles_of(ball), 0.2f);
  EXPECT_LE(cells.size(), 2u * 6 * 8);
  EXPECT_GE(cells.size(), 2u * 6);
  double area = 0;
  for (float own : cells.areas()) area += own;
  EXPECT_NEAR(area, 2 * 4 * M_PI * 0.05 * 0.05, 0.03 * area);
}

TEST(Cells, OfTrianglesWithoutAreaAreNone) {
  const BodyCells cells(std::vector<Triangle>{{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 0}}, 0.2f);
  EXPECT_EQ(cells.size(), 0u);
  EXPECT_EQ(cells.find(0, {1, 0, 0}, {0, -1, 0}), kNoCell);
}

/// A floor with a movable block.
struct Floor : direct::World {
  Floor() {
    scene::Object ground, block;
    direct::add_quad(ground, {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
    block.name = "block";
    block.movable = true;
    direct::add_box(block, {-0.3f, 0, -0.3f}, {0.3f, 0.5f, 0.3f});
    scene.objects = {ground, block};
    finish();
  }
  void place(double x, double y, double turn = 0) {
    Pose& pose = scene.objects[1].pose;
    pose.row[0] = {std::cos(turn), 0, std::sin(turn)};
    pose.row[2] = {-std::sin(turn), 0, std::cos(turn)};
    pose.translation = {x, y, 0};
    caster->update_object(scene, 1);
  }
};

TEST(Cells, FollowTheirBody) {
  Floor floor;
  const Cells cells(floor.scene, *floor.caster, 1);
  const auto top = [&](Vec3f local) {
    const Pose& pose = floor.scene.objects[1].pose;
    const CellFinder finder(floor.scene, cells);
    const Vec3f above = pose.point(local) + Vec3f{0, 0.25f, 0};
    const trace::Hit hit = floor.caster->closest(above, {0, -1, 0});
    return finder.find(hit.primitive, above, {0, -1, 0}, hit.t);
  };
  std::vector<uint32_t> first;
  for (int pass = 0; pass < 5; ++pass) {
    floor.place(0.3 * pass - 0.7, 0.1 * pass, 0.7 * pass);
    const auto range = cells.of_object(1);
    for (int i = 0; i < 25; ++i) {
      const Vec3f local{-0.27f + 0.13f * float(i % 5), 0.5f, -0.27f + 0.13f * float(i / 5)};
      const uint32_t cell = top(local);
      EXPECT_GE(cell, range.first);
      EXPECT_LT(cell, range.second);
      if (pass == 0) first.push_back(cell);
      EXPECT_EQ(cell, first[size_t(i)]);
    }
  }
}

TEST(Coverage, IsTheAreaUnderWhatStandsThere) {
  Floor floor;
  const Cells cells(floor.scene, *floor.caster, 1);
  const auto covered = [&](const Coverage& coverage) {
    double sum = 0;
    for (uint32_t cell = 0; cell < cells.of_object(1).first; ++cell)
      sum +=
          std::popcount(coverage.covered()[cell]) / double(BodyCells::kProbes) * cells.area(cell);
    return sum;
  };
  Coverage coverage;
  const Workers workers(1);
  floor.place(0.21, 0, 0.4);
  coverage.compute(floor.scene, *floor.caster, cells, workers);
  // In the plane of the floor the block counts before it, seen from below, too.
  EXPECT_NEAR(covered(coverage), 0.72, 0.03);
  for (const double height : {0.005, 0.2, 0.0, -0.1}) {
    const Box before = floor.caster->object_bounds(1);
    floor.place(-0.4, height, 1.0 + height);
    const Box after = floor.caster->object_bounds(1);
    const trace::Change change{{{1, {before, after}, after}}, {}};
    coverage.update(floor.scene, *floor.caster, cells, change, workers);
    // In the floor or on its plane it covers both of its sides.
    EXPECT_NEAR(covered(coverage), height > 0.1 ? 0 : height <= 0 ? 0.72 : 0.36, 0.05) << height;
    Coverage fresh;
    fresh.compute(floor.scene, *floor.caster, cells, workers);
    EXPECT_TRUE(std::equal(fresh.covered().begin(), fresh.covered().end(),
                           coverage.covered().begin(), coverage.covered().end()));
  }
}

}  // namespace
}  // namespace deltalux::gather
