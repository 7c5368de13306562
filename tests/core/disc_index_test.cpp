// SPDX-License-Identifier: Apache-2.0
// The disc index equals brute force: sums, hit counts and slots, on ordinary and on hostile input.
#include "estimate/disc_index/disc_index.h"

#include "disc_world.h"

namespace deltalux::estimate {
namespace {

uint64_t expect_same(const samples::DiscSet& discs, const Segments& s, SegmentEnd rule,
                     bool slabs = false, bool with_moments = true) {
  const Workers workers(1);
  return expect_same(DiscIndex(discs, rule, workers), s, rule, slabs, with_moments);
}

// A lattice: many segments pass exactly through edges and corners of boxes.
TEST(DiscIndex, EqualsBruteForceOnLattice) {
  Draw draw(5);
  samples::DiscSet discs;
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 3; ++z)
        add_disc(discs, Vec3f{float(x), float(y), float(z)}, draw.axis(), 0.5f);
  Segments s;
  for (int i = 0; i < 4000; ++i) {
    const auto coordinate = [&] { return 0.5f * float(draw.below(18)) - 0.5f; };
    const Vec3f o{coordinate(), coordinate(), coordinate()};
    const Vec3f to{coordinate(), coordinate(), coordinate()};
    s.add(o, to - o, 0.5f * float(draw.below(4)), 0.5f * float(draw.below(6)));
  }
  for (const SegmentEnd rule : kRules) EXPECT_GT(expect_same(discs, s, rule), 500u);
}

// More hits and waiting leaves than the buffers hold.
TEST(DiscIndex, ManyHitsPerSegment) {
  Draw draw(6);
  samples::DiscSet discs;
  for (int k = 0; k < 3000; ++k) add_disc(discs, {0, 0, 0}, {0, 0, 1}, 1);
  for (int k = 0; k < 3000; ++k)
    add_disc(discs, {draw.range(-0.1f, 0.1f), 0, 0.01f * float(k)}, {0, 0, 1}, draw.range(0.5f, 1));
  clip_some(discs, draw, 0.1f);
  for (uint32_t& id : discs.id) id /= 2;  // ids need be neither unique nor in order
  Segments s;
  for (int i = 0; i < 150; ++i)
    s.add({draw.range(-0.3f, 0.3f), draw.range(-0.3f, 0.3f), 40}, {0, 0, -1}, 39, kInfinity);
  EXPECT_GT(expect_same(discs, s, SegmentEnd::second), 600000u);
  expect_same(discs, s, SegmentEnd::bounded, true);
}

// Products with so short a normal underflow: hits lie off the disc's plane.
TEST(DiscIndex, DenormalNormal) {
  Draw draw(13);
  samples::DiscSet discs;
  add_disc(discs, {0.3f, 0.2f, 0.1f}, {0, 0, 7e-45f}, 0.5f);
  Segments s;
  for (int i = 0; i < 20000; ++i)
    s.add(discs.centre[0] + draw.in_cube(1), draw.direction(), kInfinity, kInfinity);
  EXPECT_GT(expect_same(discs, s, SegmentEnd::first, false, false), 300u);
}

// Directions and places for which the box tests overflow.
TEST(DiscIndex, ExtremeSegments) {
  Draw draw(12);
  const samples::DiscSet discs = room(draw, 500, 1, 0.2f, {});
  Segments s;
  for (int i = 0; i < 2000; ++i) {
    Vec3f d = draw.direction();
    if (draw.chance(0.5f)) d[int(draw.below(3))] = 0;
    const Vec3f o = draw.in_cube(1);
    const float scale = std::pow(10.0f, draw.range(-44, 38.5f));
    if (i % 2 == 0) s.add(o, d * scale, kInfinity, kInfinity);
    if (i % 2 == 1) s.add(o - d * std::min(scale, 1e30f), d * scale, 1, 1 + 1 / scale);
  }
  for (const SegmentEnd rule : kRules) EXPECT_GT(expect_same(discs, s, rule), 500u);
}

TEST(DiscIndex, RefusesDiscsThatAreNotFinite) {
  const Workers workers(1);
  for (int fault = 0; fault < 5; ++fault) {
    samples::DiscSet discs;
    for (int k = 0; k < 3; ++k) add_disc(discs, {float(k), 0, 0}, {0, 0, 1}, 1);
    if (fault == 0) discs.centre[1].y = kNaN;
    if (fault == 1) discs.centre[1].y = kInfinity;
    if (fault == 2) discs.normal[1].z = kNaN;
    if (fault == 3) discs.radius[1] = kInfinity;
    if (fault == 4) discs.radius[1] = -1;
    try {
      const DiscIndex index(discs, SegmentEnd::first, workers);
      ADD_FAILURE() << "fault " << fault << " passed";
    } catch (const OptionError& error) {
      EXPECT_NE(std::string(error.what()).find("disc 1:"), std::string::npos) << error.what();
    }
  }
}

// The tree must not depend on the number of workers; large enough for several build tasks.
TEST(DiscIndex, SameTreeForAnyNumberOfWorkers) {
  Draw draw(9);
  const samples::DiscSet discs = room(draw, 150000, 10, 0.03f, {});
  const Segments s = hostile_segments(draw, discs, 3000, 10, {});
  std::vector<int64_t> sums[2];
  Stats stats[2];
  size_t bytes[2];
  for (int i = 0; i < 2; ++i) {
    const Workers workers(1 + 3 * i);
    const DiscIndex index(discs, SegmentEnd::second, workers);
    sums[i].resize(3 * discs.size());
    stats[i] = index.accumulate(s.span(false), 1, {sums[i].data(), discs.size()});
    bytes[i] = index.bytes();
  }
  EXPECT_EQ(sums[0], sums[1]);
  EXPECT_EQ(stats[0].hits, stats[1].hits);
  EXPECT_EQ(stats[0].node_tests, stats[1].node_tests);
  EXPECT_EQ(stats[0].disc_tests, stats[1].disc_tests);
  EXPECT_EQ(bytes[0], bytes[1]);
  EXPECT_LT(bytes[0], discs.size() * 120);
  EXPECT_LT(stats[0].disc_tests, s.size() * discs.size() / 20) << "the boxes must cull";
}

TEST(DiscIndex, BuildCanBeCancelled) {
  Draw draw(11);
  Progress progress;
  progress.cancel();
  const Workers workers(2);
  EXPECT_THROW(DiscIndex(room(draw, 50000, 1, 0.01f, {}), SegmentEnd::first, workers, &progress),
               Cancelled);
}

}  // namespace
}  // namespace deltalux::estimate
