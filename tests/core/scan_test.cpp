// SPDX-License-Identifier: Apache-2.0
// The scan lists every segment that meets a box, and none that misses it by more than a cell.
#include "session/paths/scan.h"

#include <functional>

#include "disc_world.h"
#include "with_isa.h"

namespace deltalux::session {
namespace {

using estimate::Draw;
using segments::ScanGrid;

/// Whether the straight line from `a` to `b` meets the box, grown by `more` on each axis.
bool meets(const Box& box, Vec3f a, Vec3f b, Vec3d more) {
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double from = a[axis], way = double(b[axis]) - from;
    const double low = double(box.low[axis]) - more[axis],
                 high = double(box.high[axis]) + more[axis];
    if (way == 0) {
      if (from < low || from > high) return false;
      continue;
    }
    const double p = (low - from) / way, q = (high - from) / way;
    enter = std::max(enter, std::min(p, q)), leave = std::min(leave, std::max(p, q));
  }
  return enter <= leave;
}

struct Line {
  Vec3f from, to;
};

/// Lines of all lengths within the world, some along axes, some out of its corners.
std::vector<Line> lines(const Box& world, Draw& draw, size_t count) {
  const Vec3f size = world.extent();
  const auto place = [&] {
    Vec3f p = world.low;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] += size[axis] * (draw.chance(0.1f) ? float(draw.below(2)) : draw.unit());
    return p;
  };
  std::vector<Line> out;
  while (out.size() < count) {
    Line line{place(), place()};
    const float part = std::pow(10.0f, draw.range(-3, 0));
    for (int axis = 0; axis < 3; ++axis) {
      line.to[axis] = line.from[axis] + part * (line.to[axis] - line.from[axis]);
      if (draw.chance(0.1f)) line.to[axis] = line.from[axis];
    }
    out.push_back(line);
  }
  return out;
}

Box box_in(const Box& world, Draw& draw) {
  const Vec3f size = world.extent();
  Box box = world;
  for (int axis = 0; axis < 3; ++axis) {
    const float half = draw.chance(0.1f) ? 0 : 0.3f * std::pow(10.0f, draw.range(-1.3f, 0));
    const float middle = draw.unit();
    box.low[axis] = world.low[axis] + size[axis] * std::max(0.0f, middle - half);
    box.high[axis] = world.low[axis] + size[axis] * std::min(1.0f, middle + half);
  }
  return box;
}

TEST(Scan, ListsWhatMeetsABoxAndNothingFarFromIt) {
  // Ends of outlines are rounded by half a cell, boxes are widened by 0.55.
  constexpr double kRounding = 1e-2, kBeside = 1.05 + kRounding;
  const Box worlds[] = {{{0, 0, 0}, {4, 3, 4}}, {{-20, 1, 100}, {180, 1.5f, 103}}};
  size_t found = 0, beside = 0;
  for (uint64_t seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Draw draw(seed);
    const Box& world = worlds[seed % 2];
    const ScanGrid grid(world);
    const std::vector<Line> all = lines(world, draw, 16 * (1 + draw.below(64)));
    std::vector<uint32_t> low, high;
    for (const Line& line : all) {
      const bool used = low.size() % 9 != 4;
      const segments::CellBox outline =
          used ? grid.cell_box(line.from, line.to) : ScanGrid::kUnused;
      low.push_back(outline.low), high.push_back(outline.high);
    }
    std::vector<Box> boxes;
    std::vector<ScanBox> scanned;
    for (uint32_t i = 0; i < seed % 4; ++i) {
      boxes.push_back(box_in(world, draw));
      scanned.push_back(scan_box(grid, boxes.back()));
    }
    const Vec3d cell{1 / double(grid.cells_per_metre.x), 1 / double(grid.cells_per_metre.y),
                     1 / double(grid.cells_per_metre.z)};
    for (const Isa each : available_isas()) {
      const WithIsa with(each);
      std::vector<uint32_t> candidates{7};  // what was there stays
      scan(low.data(), high.data(), low.size(), scanned, 5000, candidates);
      ASSERT_EQ(candidates.front(), 7u);
      EXPECT_EQ(std::adjacent_find(candidates.begin() + 1, candidates.end(), std::greater_equal{}),
                candidates.end());  // in order, each once
      const auto listed = [&](size_t i) {
        return std::binary_search(candidates.begin() + 1, candidates.end(), uint32_t(5000 + i));
      };
      size_t seen = 0;
      for (size_t i = 0; i < all.size(); ++i) {
        const auto any = [&](double cells) {
          return std::any_of(boxes.begin(), boxes.end(), [&](const Box& box) {
            return meets(box, all[i].from, all[i].to, cell * cells);
          });
        };
        seen += listed(i);
        if (i % 9 == 4)
          EXPECT_FALSE(listed(i)) << "not in use: " << i;
        else if (any(-1e-6))
          EXPECT_TRUE(listed(i)) << i;
        else if (!any(kBeside))
          EXPECT_FALSE(listed(i)) << i;
        else
          ++beside;
        found += i % 9 != 4 && any(-1e-6);
      }
      EXPECT_EQ(candidates.size(), 1 + seen);  // nothing but these segments
    }
  }
  EXPECT_GT(found, 3000u);
  EXPECT_LT(beside, found);
}

// Where ends are rounded away from each other, by almost half a cell, the box's margin has to cover
// it.
TEST(Scan, ListsWhatJustTouchesABox) {
  const Box world{{0, 0, 0}, {4, 3, 4}};
  const ScanGrid grid(world);
  for (uint64_t seed = 0; seed < 300; ++seed) {
    Draw draw(seed);
    const int axis = int(draw.below(3));
    const bool above = draw.chance(0.5f);
    // The box's face, in cells, is just off the middle between two of them.
    const float cell = 10 + float(draw.below(400)) + (above ? 0.499f : 0.501f);
    Box box{{0.5f, 0.5f, 0.5f}, {3, 2, 3}};
    float& face = above ? box.low[axis] : box.high[axis];
    face = grid.origin[axis] + cell / grid.cells_per_metre[axis];
    if (!(box.low[axis] < box.high[axis])) continue;
    Vec3f touching = (box.low + box.high) * 0.5f, far = touching;
    touching[axis] = face;
    far[axis] = above ? world.low[axis] : world.high[axis];
    const segments::CellBox outline = grid.cell_box(touching, far);
    const std::vector<uint32_t> low(16, outline.low), high(16, outline.high);
    const ScanBox scanned = scan_box(grid, box);
    for (const Isa each : available_isas()) {
      const WithIsa with(each);
      std::vector<uint32_t> candidates;
      scan(low.data(), high.data(), low.size(), {&scanned, 1}, 0, candidates);
      EXPECT_EQ(candidates.size(), 16u) << seed;
    }
  }
}

}  // namespace
}  // namespace deltalux::session
