// SPDX-License-Identifier: Apache-2.0
// Guides: chances of directions add up to one, and weighted rays bring what even ones bring.
#include "gather/aim/guide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "direct_world.h"
#include "gather/aim/direction_sampler.h"

namespace deltalux::gather {
namespace {

constexpr size_t kSide = Guide::kSide, kQuarter = kSide / 4;

/// A square in the plane y = 0 whose chances grow along both axes.
Guide ramp(Vec3f centre = {0.4f, 0, -0.2f}, float half = 0.3f) {
  Guide guide{};
  guide.centre = centre, guide.normal = {0, 1, 0}, guide.half = guide.rise = half;
  guide.radiosity = guide.brightest = 50, guide.around = 1;
  for (size_t k = 0; k <= kSide; ++k) {
    const float x = float(k) / kSide;
    guide.row[k] = x * x;
    for (auto& column : guide.column) column[k] = 0.5f * (x + x * x);
  }
  return guide;
}

Vec3f random_direction(uint32_t i, uint64_t seed) {
  const auto r = sobol::sample(i, seed);
  const float z = 2 * r[0] - 1, flat = std::sqrt(1 - z * z);
  const float phi = 2 * std::numbers::pi_v<float> * r[1];
  return {flat * std::cos(phi), z, flat * std::sin(phi)};
}

TEST(Guide, ChancesOfDirectionsAddUpToOne) {
  for (const Vec3f from : {Vec3f{0, 1, 0}, Vec3f{1.5f, 0.3f, 0.5f}, Vec3f{0.4f, 0.1f, -0.2f}}) {
    const Guide guide = ramp();
    const Square square(guide);
    double sum = 0;
    constexpr uint32_t kCount = 1 << 20;
    for (uint32_t i = 0; i < kCount; ++i)
      sum += double(square.density(from, random_direction(i, 3)));
    // Uniform directions: 4 pi over pi. The last place is so close that few of them bring most.
    EXPECT_NEAR(4 * sum / kCount, 1, 0.02);
  }
}

TEST(Guide, WhatSquaresRuleOutHasNoDensity) {
  std::vector<Guide> guides;
  for (uint32_t g = 0; g < kMaxUsed; ++g) {
    Guide guide = ramp(random_direction(g, 5) * std::ldexp(1.0f, int(g) - 2), 0.2f);
    guide.normal = random_direction(g, 6);
    guides.push_back(guide);
  }
  GuideSquares<kMaxUsed> squares;
  for (uint32_t g = 0; g < kMaxUsed; ++g) squares.set(g, guides[g]);
  size_t ruled_out = 0, dense = 0;
  constexpr uint32_t kCount = 1 << 16;
  for (uint32_t i = 0; i < kCount; ++i) {
    const Vec3f from = random_direction(i, 8) * 0.5f;
    // Every second one towards a guide's rim.
    const auto r = sobol::sample(i, 9);
    const Guide& guide = guides[i / 2 % kMaxUsed];
    const Vec3f w = i % 2 ? random_direction(i, 10)
                          : normalize(guide.point(1.1f * r[0] - 0.05f, i % 4 ? r[1] : 1) - from);
    alignas(64) std::array<float, kMaxUsed> may;
    squares.may_meet(from, w, kMaxUsed, may);
    for (uint32_t g = 0; g < kMaxUsed; ++g) {
      const bool is_dense = Square(guides[g]).density(from, w) > 0;
      ruled_out += !(may[g] > 0), dense += is_dense;
      ASSERT_FALSE(is_dense && !(may[g] > 0)) << i << ", guide " << g;
    }
  }
  EXPECT_GT(ruled_out, 5 * kCount);
  EXPECT_GT(dense, kCount / 4);
}

/// Where no ray asks what stands before a lamp.
struct Nowhere : direct::World {
  Nowhere() {
    scene.objects.emplace_back();
    direct::add_quad(scene.objects[0], {0, 0, 0}, {1, 0, 0}, {0, 0, 1});
    finish();
  }
};

TEST(Targets, TellOfAllSquaresWhatEachTells) {
  std::vector<Guide> guides;
  for (uint32_t g = 0; g < 21; ++g) {
    Guide guide = ramp(random_direction(g, 5) * 2.0f, 0.1f + 0.02f * float(g));
    guide.normal = random_direction(g, 6), guide.radiosity = float(1 + g), guide.around = 3;
    guides.push_back(guide);
  }
  const Nowhere world;
  const Beams none;
  const Targets targets(guides, none);
  ASSERT_EQ(targets.size(), guides.size());
  size_t bring = 0, dense = 0;
  for (uint32_t i = 0; i < 4096; ++i) {
    const Vec3f from = random_direction(i, 8) * 0.5f, n = random_direction(i, 9);
    const Vec3f w = normalize(guides[i % 21].centre - from);
    alignas(64) Targets::Values share, may;
    targets.shares(from, n, share);
    targets.may_be_dense(from, w, may);
    for (size_t g = 0; g < targets.size(); ++g) {
      ASSERT_EQ(targets.number(g), g);
      ASSERT_EQ(&targets.numbered(uint16_t(g)), &targets[g]);
      ASSERT_EQ(share[g], targets[g].share(from, n)) << i << ", guide " << g;
      bool in_beam = false;
      const bool is_dense = targets[g].density({from, w, 1, {}, *world.caster}, in_beam) > 0;
      ASSERT_FALSE(is_dense && !(may[g] > 0)) << i << ", guide " << g;
      bring += share[g] > 0, dense += is_dense;
    }
  }
  EXPECT_GT(bring, 4096u);
  EXPECT_GT(dense, 2048u);
}

TEST(Guide, DirectionsComeByTheirChances) {
  const Guide guide = ramp();
  const Vec3f from{1.5f, 0.6f, 0.5f};
  const Square square(guide);
  constexpr uint32_t kCount = 1 << 16;
  std::array<std::array<double, 4>, 4> found{}, expected{};
  Vec3f u, v;
  tangent_frame(guide.normal, u, v);
  for (uint32_t i = 0; i < kCount; ++i) {
    const auto r = sobol::sample(i, 7);
    const Vec3f w = square.direction(from, r[0], r[1]);
    ASSERT_GT(square.density(from, w), 0);
    const Vec3f off = from + w * (-from.y / w.y) - guide.centre;
    const auto place = [&](Vec3f axis) {
      return std::min(size_t(3), size_t(2 * (dot(off, axis) / guide.half + 1)));
    };
    found[place(v)][place(u)] += 1.0 / kCount;
  }
  for (size_t k = 0; k < 4; ++k)
    for (size_t i = 0; i < 4; ++i) {
      const auto& column = guide.column[0];
      expected[k][i] = double(guide.row[kQuarter * (k + 1)] - guide.row[kQuarter * k]) *
                       double(column[kQuarter * (i + 1)] - column[kQuarter * i]);
      EXPECT_NEAR(found[k][i], expected[k][i], 2e-3);
    }
}

/// Light from above a plane: a bright place, and a little from everywhere.
double light(Vec3f from, Vec3f w) {
  const double t = w.y < 0 ? double(-from.y / w.y) : 0.0;
  const double x = double(from.x) + t * double(w.x) - 0.4,
               z = double(from.z) + t * double(w.z) + 0.2;
  return t > 0 && x * x + z * z < 0.04 ? 50.0 : 1.0 + double(w.x);
}

TEST(Guide, DrawnDirectionsBringTheSameLightWithLessNoise) {
  const Nowhere world;
  Guiding guiding;
  guiding.guides = {ramp(), ramp({-3, 0, 0}, 0.2f)};
  const Vec3f from{-1, 1.2f, 0.7f}, n = normalize(Vec3f{0.5f, -0.7f, -0.1f});
  constexpr uint32_t kCount = 1 << 18;
  double even = 0, even_squares = 0, drawn = 0, drawn_squares = 0;
  const Beams none;
  const Targets targets(guiding.guides, none);
  const DirectionSampler turn(targets, from, n);
  for (uint32_t i = 0; i < kCount; ++i) {
    const auto r = sobol::sample(i, 5);
    const double a = light(from, cosine_direction(n, r[0], r[1]));
    bool in_beam = false;
    const Aim next = turn.draw(r[2], r[1], in_beam);
    const double b = next.w == Vec3f{} ? 0.0
                                       : double(turn.weight(next, 1, {}, *world.caster, in_beam)) *
                                             light(from, next.w);
    ASSERT_FALSE(in_beam);
    even += a / kCount, even_squares += a * a / kCount;
    drawn += b / kCount, drawn_squares += b * b / kCount;
  }
  EXPECT_NEAR(drawn / even, 1, 0.005);
  EXPECT_LT(drawn_squares - drawn * drawn, 0.3 * (even_squares - even * even));
}

class GuidedRays : public testing::TestWithParam<uint32_t> {
 protected:
  GuidedRays() {
    guiding_.guides = {ramp(), ramp({0.5f, 0, 0.5f}, 0.2f)};
    for (uint32_t i = 0; i < 500; ++i) {
      RayAllotment shares;
      shares.target = {0, 1};
      const uint16_t most = uint16_t(GetParam() / 16);
      shares.eighth = {uint16_t(i % 3 ? (most + 1) / 2 : 0), uint16_t(i % 2 ? most / 2 : 0)};
      guiding_.allotments.push_back(shares);
    }
  }
  Guiding guiding_;
  const Beams none_;
  const Nowhere world_;
  Vec3f from_{-1, 1.2f, 0.7f}, n_ = normalize(Vec3f{0.5f, -0.7f, -0.1f});
};

TEST_P(GuidedRays, EachPartBringsTheSameLight) {
  const uint32_t rays = GetParam();
  const Directions directions(rays, 3);
  const Targets targets(guiding_.guides, none_);
  const auto part_of = [&](uint32_t ray) { return ((ray + 1) * kParts - 1) / rays; };
  double even = 0, part[kParts] = {}, all = 0;
  uint32_t count[kParts] = {};
  for (uint32_t ray = 0; ray < rays; ++ray) ++count[part_of(ray)];
  for (uint32_t i = 0; i < 1u << 18; ++i) {
    const auto r = sobol::sample(i, 5);
    even += light(from_, cosine_direction(n_, r[0], r[1])) / (1u << 18);
  }
  for (uint32_t sample = 0; sample < 500; ++sample) {
    const SampleRays own(directions, guiding_.allotments, targets, sample, rays,
                         {from_, n_, scene::kNone, 0, sample});
    for (uint32_t ray = 0; ray < rays; ++ray) {
      const Vec3f w = own.aim(ray).w;
      bool in_beam = false;
      if (w == Vec3f{}) continue;
      const double weight = double(own.weight(ray, w, 1, {}, *world_.caster, in_beam));
      part[part_of(ray)] += weight * light(from_, w) / 500;
    }
  }
  // Where eight does not divide the rays, guides have a little more of some parts than of others.
  for (uint32_t k = 0; k < kParts; ++k) {
    EXPECT_NEAR(part[k] / count[k] / even, 1, 0.06);
    all += part[k] / rays;
  }
  EXPECT_NEAR(all / even, 1, 0.015);
}

TEST_P(GuidedRays, TowardsABallAreAllFoundOnce) {
  const uint32_t rays = GetParam();
  const Directions directions(rays, 3);
  const Targets targets(guiding_.guides, none_);
  for (uint32_t sample = 0; sample < 500; ++sample) {
    const SampleRays own(directions, guiding_.allotments, targets, sample, rays,
                         {from_, n_, scene::kNone, 0, sample});
    const Vec3f centre = from_ + random_direction(sample, 6) * (3 * sobol::sample(sample, 8)[0]);
    const float radius = 0.02f + 0.5f * sobol::sample(sample, 8)[1];
    std::vector<uint8_t> found(rays);
    own.each_towards(centre, radius, [&](uint32_t ray) {
      EXPECT_FALSE(found[ray]) << "twice";
      found[ray] = 1;
    });
    for (uint32_t ray = 0; ray < rays; ++ray) {
      const Vec3f w = own.aim(ray).w, to_centre = centre - from_;
      const float along = dot(to_centre, w);
      const float nearest = dot(to_centre, to_centre) - along * along;
      const bool inside = length(to_centre) <= radius;
      EXPECT_TRUE(found[ray] || w == Vec3f{} ||
                  !(inside || (along > 0 && nearest <= radius * radius)))
          << sample << " " << ray;
    }
  }
}

/// A lid above the plane; only a slit of it, as wide as `open`, lets the guide be seen.
struct UnderALid : direct::World {
  explicit UnderALid(float open) {
    scene.objects.emplace_back();
    direct::add_quad(scene.objects[0], {-2, 0, -2}, {4, 0, 0}, {0, 0, 4});
    direct::add_quad(scene.objects[0], {-2, 0.7f, -2}, {2, 0, 0}, {0, 0, 4});
    direct::add_quad(scene.objects[0], {open, 0.7f, -2}, {2, 0, 0}, {0, 0, 4});
    finish();
  }
};

/// Of 500 places at the same point, how many have rays for the guide.
size_t with_rays(float open) {
  const UnderALid world(open);
  const std::vector<Guide> guides = {ramp({0, 0, 0}, 0.5f)};
  const Beams none;
  const Targets targets(guides, none);
  size_t count = 0;
  for (uint32_t key = 0; key < 500; ++key) {
    const direct::Receiver receiver{{0, 1, 0}, {0, -1, 0}, scene::kNone, 0, key};
    count += see_targets(targets, receiver, 256, *world.caster, 5).count > 0;
  }
  return count;
}

TEST(SeeTargets, AGuideInASlitIsFound) {
  EXPECT_EQ(with_rays(0.5f), 500u);
  // About a twentieth of it is seen: 64 hits miss that once in 27 times, eight twice in three.
  EXPECT_GT(with_rays(0.015f), 460u);
  EXPECT_EQ(with_rays(0), 0u);
}

INSTANTIATE_TEST_SUITE_P(Counts, GuidedRays, testing::Values(64u, 100u, 256u));

}  // namespace
}  // namespace deltalux::gather
