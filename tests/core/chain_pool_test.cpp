// SPDX-License-Identifier: Apache-2.0
// Chains that come and go are those that were added, and send what a new pool's would.
#include "gather/hits/chain_pool.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "base/random.h"

namespace deltalux::gather {
namespace {

struct Added {
  std::vector<Vertex> vertices;
  std::vector<Place> places;
  std::vector<Tint> tints;
  uint32_t end;
  float weight;
  Vec3f tip;
  Points points() const { return {vertices, places, tints}; }
};

float number(uint64_t seed, uint32_t i) { return PathRandom(seed, i)(0, 0); }

Added make_chain(uint32_t i) {
  Added out{{}, {}, {}, i, 0.5f + number(1, i), {number(7, i), 0, 0}};
  const uint32_t count = 1 + uint32_t(number(2, i) * kMaxVertices);
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t light = k % 2 ? scene::kNone : i % 2;
    const float direct = k % 2 ? 0 : number(3, i + k);
    const bool tinted = i % 3 == 0 && k % 5 != 4;
    out.tints.push_back(tinted ? Tint::of({number(10, i + k), 2, number(11, i)}) : Tint{});
    if (k % 5 == 4)
      out.vertices.push_back(Vertex::of_factor({number(4, i + k), number(5, i + k), 1}));
    else
      out.vertices.push_back({(i + k) % 3, light, direct, number(4, i + k)});
    out.places.push_back({number(8, i + k), float(k), 0, k, number(9, i + k)});
  }
  return out;
}

Paint make_paint(float dim) {
  return {{{0.5f, 0.4f, 0.3f}, {0.9f, 0.8f, 0.7f}, {0.1f, 0.2f, 0.6f}},
          {{1, 1, 1}, {0.5f, 0, 1}, {1, 0.25f, 1}},
          {dim, 1},
          {{dim, 2 * dim, dim}, {1, 0.5f, 3}}};
}

void expect_same(const ChainPool& pool, const std::map<uint32_t, Added>& chains, const Paint& paint,
                 const Workers& workers) {
  ASSERT_EQ(pool.size(), chains.size());
  ChainPool fresh;
  for (const auto& [own, added] : chains)
    fresh.add(added.points(), added.end, added.weight, added.tip);
  fresh.paint(paint, workers);
  uint32_t other = 0;
  for (const auto& [own, added] : chains) {
    const auto vertices = pool.vertices(own);
    ASSERT_TRUE(
        std::equal(vertices.begin(), vertices.end(), added.vertices.begin(), added.vertices.end()));
    const auto tints = pool.tints(own);
    ASSERT_TRUE(std::equal(tints.begin(), tints.end(), added.tints.begin(), added.tints.end()));
    EXPECT_EQ(pool.sent(own).direct, fresh.sent(other).direct);
    EXPECT_EQ(pool.sent(own).through, fresh.sent(other).through);
    EXPECT_EQ(pool.end(own), added.end);
    EXPECT_EQ(pool.tip(own), added.tip);
    size_t k = 0;
    pool.each_bend(own, [&](Vec3f point) { EXPECT_EQ(point, added.places[k++].point()); });
    EXPECT_EQ(k, added.places.size());
    ++other;
  }
}

TEST(ChainPool, HoldsWhatWasAddedAndNotTakenAway) {
  const Workers workers(2);
  ChainPool pool;
  std::map<uint32_t, Added> chains;
  const auto add = [&](uint32_t first, uint32_t last) {
    for (uint32_t i = first; i < last; ++i) {
      const Added chain = make_chain(i);
      const uint32_t own = pool.add(chain.points(), chain.end, chain.weight, chain.tip);
      ASSERT_TRUE(chains.emplace(own, chain).second);
    }
  };
  // More vertices than lie in a row, so that some do not fit at the end of one.
  add(0, 6000);
  pool.paint(make_paint(1), workers);
  expect_same(pool, chains, make_paint(1), workers);
  for (auto chain = chains.begin(); chain != chains.end();) {
    if (number(6, chain->first) < 0.5f) {
      pool.remove(chain->first);
      chain = chains.erase(chain);
    } else {
      ++chain;
    }
  }
  expect_same(pool, chains, make_paint(1), workers);
  const size_t vertices = pool.vertex_count();
  add(6000, 8000);  // painted as they come, in freed places
  EXPECT_LT(pool.vertex_count(), vertices + vertices / 20);
  expect_same(pool, chains, make_paint(1), workers);
  pool.paint(make_paint(0.25f), workers);
  expect_same(pool, chains, make_paint(0.25f), workers);
  // Another light at the same places.
  for (auto& [own, chain] : chains) {
    for (Vertex& vertex : chain.vertices)
      if (!vertex.is_factor()) vertex.direct *= 0.5f;
    pool.relight(own, chain.vertices);
  }
  expect_same(pool, chains, make_paint(0.25f), workers);
  const ChainPool moved = std::move(pool);
  expect_same(moved, chains, make_paint(0.25f), workers);
}

// A point's tint tells less the less contrast its material has; a lobe's factors are what they are.
TEST(ChainPool, ScalesTintsOfPoints) {
  const Place place{0, 0, 0, 0, 0};
  const std::array<Place, 2> places{place, place};
  const std::array<Vertex, 2> vertices{Vertex::of_factor({1, 0.5f, 1}), {1, 0, 1, 1}};
  const std::array<Tint, 2> plain{}, tints{Tint{}, Tint::of({2, 0.5f, 0})};
  ChainPool pool;
  const uint32_t first = pool.add({vertices, places, plain}, kDark, 1, {});
  EXPECT_FALSE(pool.has_tints());
  const uint32_t second = pool.add({vertices, places, tints}, kDark, 1, {});
  EXPECT_TRUE(pool.has_tints());
  EXPECT_TRUE(pool.is(first, {vertices, places, {}}, kDark, 1));
  EXPECT_TRUE(pool.is(second, {vertices, places, tints}, kDark, 1));
  EXPECT_FALSE(pool.is(second, {vertices, places, plain}, kDark, 1));
  pool.paint(make_paint(1), Workers(1));
  // Reflectance (0.9, 0.8, 0.7), contrast (0.5, 0, 1), lamp (1, 2, 1).
  const std::array<float, 3> without{0.9f, 2 * 0.8f * 0.5f, 0.7f};
  const std::array<float, 3> with{0.9f * 1.5f, 2 * 0.8f * 0.5f, 0};
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_FLOAT_EQ(pool.sent(first).direct[c], without[c]);
    EXPECT_FLOAT_EQ(pool.sent(second).direct[c], with[c]);
  }
  EXPECT_FLOAT_EQ(pool.sent(first).through[0], 0.9f);
  EXPECT_FLOAT_EQ(pool.sent(second).through[0], 0.9f * 1.5f);
}

// The tint of a point at the end is that of lamps alone: the cell has its own.
TEST(ChainPool, LeavesTheTintOfAnEndToItsCell) {
  const std::array<Vertex, 1> vertices{Vertex{0 | Vertex::kEnd, 0, 1, 1}};
  const std::array<Place, 1> places{Place{0, 0, 0, 0, 0}};
  const std::array<Tint, 1> tints{Tint::of({2, 2, 2})};
  ChainPool pool;
  const uint32_t own = pool.add({vertices, places, tints}, 7, 1, {});
  pool.paint(make_paint(1), Workers(1));
  EXPECT_FLOAT_EQ(pool.sent(own).direct[0], 2 * 0.5f);
  EXPECT_FLOAT_EQ(pool.sent(own).through[0], 1);
}

TEST(Tint, IsExactToAFifthOfAPercent) {
  EXPECT_EQ(Tint::of({1, 1, 1}), Tint{});
  EXPECT_EQ(Tint{}.value(), (Vec3f{1, 1, 1}));
  for (uint32_t i = 0; i < 20000; ++i) {
    const float scale = std::exp2(30 * number(1, i) - 15);
    const Vec3f value{scale * number(2, i), scale * number(3, i), scale * number(4, i)};
    const Vec3f found = Tint::of(value).value();
    const float most = std::max({value.x, value.y, value.z, 0x1p-15f});
    for (int c = 0; c < 3; ++c) EXPECT_LE(std::fabs(found[c] - value[c]), most / 511);
    EXPECT_EQ(Tint::of(found), Tint::of(value));
  }
  EXPECT_EQ(Tint::of({0, 0, 0}).value(), Vec3f{});
  EXPECT_EQ(Tint::of({1e9f, 1, 0}).value(), (Vec3f{Tint::kMost, 0, 0}));
  EXPECT_EQ(Tint::of({511.9f, 256, 0}).value(), (Vec3f{512, 256, 0}));
}

}  // namespace
}  // namespace deltalux::gather
