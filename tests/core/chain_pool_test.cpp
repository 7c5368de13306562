// SPDX-License-Identifier: Apache-2.0
// Chains that come and go are those that were added, and send what a new pool's would.
#include "gather/hits/chain_pool.h"

#include <gtest/gtest.h>

#include <map>

#include "base/random.h"

namespace deltalux::gather {
namespace {

struct Added {
  std::vector<Vertex> vertices;
  std::vector<Place> places;
  uint32_t end;
  float weight;
  Vec3f tip;
};

float number(uint64_t seed, uint32_t i) { return PathRandom(seed, i)(0, 0); }

Added make_chain(uint32_t i) {
  Added out{{}, {}, i, 0.5f + number(1, i), {number(7, i), 0, 0}};
  const uint32_t count = 1 + uint32_t(number(2, i) * kMaxVertices);
  for (uint32_t k = 0; k < count; ++k) {
    const uint32_t light = k % 2 ? scene::kNone : i % 2;
    const float direct = k % 2 ? 0 : number(3, i + k);
    if (k % 5 == 4)
      out.vertices.push_back(Vertex::tint({number(4, i + k), number(5, i + k), 1},
                                          i % 2 ? Vertex::kOfSurface | (i + k) % 3 : 0));
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
    fresh.add(added.vertices, added.places, added.end, added.weight, added.tip);
  fresh.paint(paint, workers);
  uint32_t other = 0;
  for (const auto& [own, added] : chains) {
    const auto vertices = pool.vertices(own);
    ASSERT_TRUE(
        std::equal(vertices.begin(), vertices.end(), added.vertices.begin(), added.vertices.end()));
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
      const uint32_t own =
          pool.add(chain.vertices, chain.places, chain.end, chain.weight, chain.tip);
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
      if (!vertex.is_tint()) vertex.direct *= 0.5f;
    pool.relight(own, chain.vertices);
  }
  expect_same(pool, chains, make_paint(0.25f), workers);
  const ChainPool moved = std::move(pool);
  expect_same(moved, chains, make_paint(0.25f), workers);
}

// A surface's tint tells less the less contrast its material has; a lobe's is what it is.
TEST(ChainPool, ScalesTintsOfSurfaces) {
  const Vec3f tint{2, 0.5f, 0};
  const Place place{0, 0, 0, 0, 0};
  const std::array<Place, 2> places{place, place};
  const std::array<Vertex, 2> of_surface{Vertex::tint(tint, Vertex::kOfSurface | 1), {1, 0, 1, 1}};
  const std::array<Vertex, 2> of_lobe{Vertex::tint(tint), {1, 0, 1, 1}};
  ChainPool pool;
  const uint32_t first = pool.add(of_surface, places, kDark, 1, {});
  const uint32_t second = pool.add(of_lobe, places, kDark, 1, {});
  pool.paint(make_paint(1), Workers(1));
  // Reflectance (0.9, 0.8, 0.7), contrast (0.5, 0, 1), lamp (1, 2, 1).
  const std::array<float, 3> half{0.9f * 1.5f, 2 * 0.8f, 0}, full{0.9f * 2, 2 * 0.8f * 0.5f, 0};
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_FLOAT_EQ(pool.sent(first).direct[c], half[c]);
    EXPECT_FLOAT_EQ(pool.sent(second).direct[c], full[c]);
  }
  EXPECT_FLOAT_EQ(pool.sent(first).through[0], 0.9f * 1.5f);
  EXPECT_FLOAT_EQ(pool.sent(second).through[0], 0.9f * 2);
}

}  // namespace
}  // namespace deltalux::gather
