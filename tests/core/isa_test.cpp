// SPDX-License-Identifier: Apache-2.0
// Every instruction set that this machine has gives the same candidates, sums, digests and light.
#include "base/cpu.h"

#include <algorithm>

#include "base/error.h"
#include "disc_world.h"
#include "session/paths/scan.h"
#include "session_world.h"
#include "with_isa.h"

namespace deltalux::session {
namespace {

using estimate::Draw;
using segments::ScanGrid;

// ---- the switch ---------------------------------------------------------------------------------

TEST(Isa, TheBestIsUsedAndTheSlowestIsAlwaysThere) {
  const std::vector<Isa> all = available_isas();
  EXPECT_EQ(all.front(), Isa::portable);
  EXPECT_LE(all.back(), processor_isa());
  for (const Isa each : all) {
    const WithIsa with(each);
    EXPECT_EQ(isa(), each);
    EXPECT_EQ(isa_named(name_of(each)), each);
  }
}

template <class Call>
void expect_refused(const std::string& name, const Call& call) {
  try {
    call();
    ADD_FAILURE() << name << " is accepted";
  } catch (const OptionError& e) {
    const std::string start = "DELTALUX_ISA: found \"" + name + "\", expected \"portable\"";
    EXPECT_EQ(std::string(e.what()).substr(0, start.size()), start);
  }
}

TEST(Isa, WhatIsNotThereIsRefused) {
  expect_refused("sse9", [] { isa_named("sse9"); });
  const std::vector<Isa> all = available_isas();
  for (const Isa each : {Isa::avx2, Isa::avx512}) {
    if (std::count(all.begin(), all.end(), each)) continue;
    expect_refused(name_of(each), [&] { use_isa(each); });
  }
}

// ---- the scan -----------------------------------------------------------------------------------

/// Segments of all lengths in the unit cube; every tenth slot is not in use.
std::vector<segments::CellBox> outlines(const ScanGrid& grid, Draw& draw, size_t count) {
  std::vector<segments::CellBox> out;
  while (out.size() < count) {
    const Vec3f from = draw.in_cube(0.5f);
    Vec3f to = from + draw.direction() * std::pow(10.0f, draw.range(-3, 0));
    for (int axis = 0; axis < 3; ++axis) {
      to[axis] = std::clamp(to[axis], -0.5f, 0.5f);
      if (draw.chance(0.1f)) to[axis] = from[axis];
    }
    out.push_back(draw.chance(0.1f) ? ScanGrid::kUnused : grid.cell_box(from, to));
  }
  return out;
}

Box any_box(Draw& draw) {
  const Vec3f middle = draw.in_cube(0.5f);
  Vec3f half;
  for (int axis = 0; axis < 3; ++axis)
    half[axis] = draw.chance(0.1f) ? 0 : 0.5f * std::pow(10.0f, draw.range(-2, 0));
  return {middle - half, middle + half};
}

TEST(Isa, ScansYieldTheSameCandidates) {
  const ScanGrid grid(Box{{-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}});
  size_t found = 0, passed_over = 0;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Draw draw(seed);
    std::vector<uint32_t> low, high;
    for (const auto& box : outlines(grid, draw, 16 * (1 + draw.below(128))))
      low.push_back(box.low), high.push_back(box.high);
    std::vector<ScanBox> boxes;
    for (uint32_t i = draw.below(4); i != ~0u; --i) boxes.push_back(scan_box(grid, any_box(draw)));
    std::vector<std::vector<uint32_t>> candidates;
    for (const Isa each : available_isas()) {
      const WithIsa with(each);
      candidates.push_back({7});  // what was there stays
      scan(low.data(), high.data(), low.size(), boxes, 1000, candidates.back());
      EXPECT_EQ(candidates.back(), candidates[0]) << name_of(each);
    }
    found += candidates[0].size() - 1, passed_over += low.size() - candidates[0].size() + 1;
  }
  EXPECT_GT(found, 3000u);
  EXPECT_GT(passed_over, 10000u);
}

// Random boxes hardly ever lie at a border, where one rounding decides.
TEST(Isa, ScansDecideBordersAlike) {
  size_t found = 0;
  constexpr size_t kSeeds = 2000;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    Draw draw(seed);
    const auto cells = [&] {
      return Vec3f{float(draw.below(1024)), float(draw.below(512)), float(draw.below(1024))};
    };
    const Vec3f a = cells(), b = cells(), low = min(a, b), high = max(a, b);
    const uint32_t guards = draw.below(4) << 10;
    const std::vector<uint32_t> lows(16, ScanGrid::pack(low) | (guards & ScanGrid::kFallsInZ)),
        highs(16, ScanGrid::pack(high) | ScanGrid::kGuards);
    // Every cell, but a sliver across the second axis that just touches the segment, or just not.
    const Vec3f centre{draw.range(0, 2000), draw.range(0, 1000), draw.range(0, 2000)};
    ScanBox box{0, ~0u, {centre.x, centre.y, centre.z}, {1e30f, 0, 0}};
    const Vec3f c = low + high - centre, way = high - low;
    if (way.y == 0) continue;
    const float hz = guards & ScanGrid::kFallsInZ ? -way.z : way.z;
    box.half[2] = std::fabs(way.y * c.z - hz * c.y) / way.y;
    if (draw.chance(0.5f)) box.half[2] = std::nextafter(box.half[2], 0.0f);
    std::vector<std::vector<uint32_t>> candidates;
    for (const Isa each : available_isas()) {
      const WithIsa with(each);
      scan(lows.data(), highs.data(), 16, {&box, 1}, 0, candidates.emplace_back());
      EXPECT_EQ(candidates.back(), candidates[0]) << name_of(each) << ", seed " << seed;
    }
    found += candidates[0].size() / 16;
  }
  EXPECT_GT(found, kSeeds / 4);
  EXPECT_LT(found, kSeeds * 9 / 10);
}

// ---- sessions -----------------------------------------------------------------------------------

/// What a session shows after a bake and after each edit.
struct Shown {
  std::vector<std::array<uint64_t, 4>> digests;
  std::vector<int64_t> sums;
  std::vector<double> light;
  std::vector<uint64_t> candidates;
  bool operator==(const Shown&) const = default;
};

const std::vector<std::vector<scene::Edit>>& edits() {
  static const std::vector<std::vector<scene::Edit>> all = {
      {scene::Move{1, at(2.5, 2)}},
      {scene::SetPresent{1, false}, scene::Dim{0, 0.5}},
      {scene::SetPresent{1, true}, scene::SetReflectance{0, {0.3f, 0.4f, 0.5f}}},
      {scene::Insert{second_lamp()}},
      {scene::Move{2, at(1, 3)}, scene::Move{1, at(3, 1)}}};
  return all;
}

/// `isas` take turns: the bake is by the first, the first edit by the second...
Shown run(plan::Method method, segments::SegmentEnd end, std::vector<Isa> isas) {
  Progress progress;
  Shown shown;
  Options chosen = options(2, DirectMode::paths, end);
  chosen.static_method = chosen.moving_method = method;
  Session session(room(), some_samples(), chosen);
  const auto show = [&](const Frame& frame) {
    shown.digests.push_back(session.digest());
    shown.candidates.push_back(frame.candidates);
    const size_t values = 3 * some_samples().point.size(), sums = shown.sums.size(),
                 light = shown.light.size();
    shown.sums.resize(sums + values), shown.light.resize(light + 2 * values);
    session.read_sums(shown.sums.data() + sums);
    session.read(shown.light.data() + light, shown.light.data() + light + values);
  };
  size_t turn = 0;
  const auto with_next = [&](const auto& work) {
    const WithIsa with(isas[turn++ % isas.size()]);
    show(work());
  };
  with_next([&] { return session.bake(progress); });
  for (const auto& step : edits()) with_next([&] { return session.update(step, 0, progress); });
  with_next([&] { return session.recompute(progress); });
  EXPECT_EQ(shown.digests.back(), shown.digests[shown.digests.size() - 2]);
  EXPECT_GT(*std::max_element(shown.candidates.begin(), shown.candidates.end()), 100u);
  return shown;
}

class IsaSessions : public testing::TestWithParam<plan::Method> {};

TEST_P(IsaSessions, ShowTheSame) {
  for (const auto end : {segments::SegmentEnd::first, segments::SegmentEnd::bounded}) {
    const Shown expected = run(GetParam(), end, {Isa::portable});
    EXPECT_GT(
        std::count_if(expected.sums.begin(), expected.sums.end(), [](int64_t s) { return s; }),
        500);
    for (const Isa each : available_isas())
      EXPECT_TRUE(run(GetParam(), end, {each}) == expected) << name_of(each);
    EXPECT_TRUE(run(GetParam(), end, available_isas()) == expected) << "in turn";
  }
}

INSTANTIATE_TEST_SUITE_P(All, IsaSessions,
                         testing::Values(plan::Method::brute_force, plan::Method::disc_index,
                                         plan::Method::sphere_cache, plan::Method::ray_map));

}  // namespace
}  // namespace deltalux::session
