// SPDX-License-Identifier: Apache-2.0
// Panes: what paths, gather rays and shadow rays make of them is the same.
#include "pane.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/textured.h"

namespace deltalux::surfaces {
namespace {

PaneParameters with(float coverage, float transmission, float index, float faces, float inner,
                    float tint) {
  return {coverage, transmission, index, faces, inner, tint};
}

const PaneParameters kPanes[] = {with(1, 1, 1.5f, 1, 1, 1),    with(1, 1, 1.52f, 2, 0.96f, 1),
                                 with(0.4f, 0, 1.5f, 1, 1, 1), with(0.9f, 0.6f, 2, 2, 0.8f, 0.5f),
                                 with(1, 0.7f, 1, 2, 0.5f, 1), with(0, 1, 1.5f, 1, 1, 1)};

Arrival arriving(float cosine) {
  return {{std::sqrt(1 - cosine * cosine), -cosine, 0}, {0, 2, 0}, {0.25f, 0.25f, {0.5f, 0.5f}}};
}

/// Light in each lobe, by strata of random numbers.
struct Sent {
  double straight = 0, specular = 0, diffuse = 0;
};

Sent by_paths(const Surface& surface, const Arrival& arrival) {
  constexpr int kPaths = 200000;
  Sent sent;
  for (int path = 0; path < kPaths; ++path) {
    Departure out;
    if (!surface.kind->scatter(surface, arrival, BounceRandom(3, uint64_t(path), 0), out)) continue;
    double& own = out.lobe == Lobe::straight   ? sent.straight
                  : out.lobe == Lobe::specular ? sent.specular
                                               : sent.diffuse;
    own += out.throughput.y / kPaths;
  }
  return sent;
}

Sent by_gather_rays(const Surface& surface, const Arrival& arrival) {
  constexpr int kRays = 20000;
  const double diffuse = double(surface.kind->diffuse_share(surface, arrival.at));
  Sent sent;
  sent.diffuse = diffuse * double(surface.diffuse_at(arrival.at).y);
  for (int ray = 0; ray < kRays && diffuse < 1; ++ray) {
    Onward out;
    if (!surface.kind->onward(surface, arrival, (float(ray) + 0.5f) / kRays, 0.5f, out)) continue;
    (out.lobe == Lobe::straight ? sent.straight : sent.specular) +=
        (1 - diffuse) * double(out.factor.y) / kRays;
  }
  return sent;
}

// Null hypothesis: the same light in each lobe. Paths draw lobes at random: 0.005 is 4.5 standard
// errors at least.
void expect_alike(const Surface& surface) {
  for (const float cosine : {1.0f, 0.7f, 0.3f, 0.05f}) {
    const Arrival arrival = arriving(cosine);
    const Sent paths = by_paths(surface, arrival), rays = by_gather_rays(surface, arrival);
    EXPECT_NEAR(paths.straight, rays.straight, 0.005) << cosine;
    EXPECT_NEAR(paths.specular, rays.specular, 0.005) << cosine;
    EXPECT_NEAR(paths.diffuse, rays.diffuse, 0.005) << cosine;
    EXPECT_NEAR(double(surface.kind->transmittance(surface, arrival)), rays.straight, 1e-4);
    EXPECT_LE(rays.straight + rays.specular + rays.diffuse, 1 + 1e-6);
    if (rays.specular > 0) EXPECT_TRUE(surface.kind->has_specular(surface));
    if (!surface.map) EXPECT_EQ(surface.kind->has_specular(surface), rays.specular > 0);
  }
}

TEST(Panes, SendTheSameByPathsAndGatherRays) {
  for (const PaneParameters& own : kPanes) expect_alike(pane_with(own, {0.3f, 0.8f, 0.5f}));
}

TEST(Panes, WithTexturesCoverByHowMuchTexelsCount) {
  for (const PaneParameters& own : kPanes)
    for (const uint8_t weight : {0, 100, 255}) {
      const Texture::Texel texel{200, 200, 200, weight};
      TextureMap map{
          std::make_shared<const Texture>(1, 1, std::span(&texel, 1)), {}, {}, {}, false};
      map.gain = Vec3f{1, 1, 1} * (1 / 0.5776f);  // of texels of 200
      const Surface surface = textured(pane_with(own, {0.3f, 0.8f, 0.5f}), map);
      expect_alike(surface);
      const double covered = double(own.coverage) * weight / 255;
      EXPECT_NEAR(double(surface.kind->diffuse_share(surface, arriving(1).at)),
                  covered * (1 - double(own.transmission)), 1e-6);
      EXPECT_NEAR(double(surface.diffuse_at(arriving(1).at).y), 0.8, 1e-3);
      EXPECT_EQ(surface.kind->transmits(surface),
                weight < 255 || own.coverage < 1 || own.transmission > 0);
    }
}

// Stokes (1862): one face reflects 4 % at an index of 1.5, and a plate without absorption
// 2 r / (1 + r). Along its Brewster angle, light of one polarisation passes a face as a whole.
TEST(Panes, ReflectAsGlassDoes) {
  EXPECT_NEAR(shares_of(with(1, 1, 1.5f, 1, 1, 1), 1).mirrored, 0.04, 1e-6);
  EXPECT_NEAR(shares_of(with(1, 1, 1.5f, 2, 1, 1), 1).mirrored, 0.08 / 1.04, 1e-6);
  EXPECT_NEAR(shares_of(with(1, 1, 1.5f, 2, 1, 1), 1).straight, 0.96 / 1.04, 1e-6);
  const double brewster = std::cos(std::atan(1.5));
  const double s = std::pow((1.5 * 1.5 - 1) / (1.5 * 1.5 + 1), 2);
  EXPECT_NEAR(shares_of(with(1, 1, 1.5f, 1, 1, 1), brewster).mirrored, s / 2, 1e-6);
  for (const PaneParameters& own : kPanes) {
    const PaneShares grazing = shares_of(own, 0);
    EXPECT_TRUE(std::isfinite(grazing.straight + grazing.mirrored + grazing.diffuse));
    EXPECT_LE(grazing.straight + grazing.mirrored + grazing.diffuse, 1 + 1e-6f);
  }
}

TEST(Panes, RefuseImpossibleParameters) {
  const Surface good = pane_with({});
  EXPECT_EQ(good.kind->flaw(good.parameters), nullptr);
  EXPECT_NE(good.kind->flaw(std::vector<float>{1, 1}), nullptr);
  for (size_t i = 0; i < 6; ++i)
    for (const float wrong : {-0.1f, 11.0f, std::nanf("")}) {
      std::vector<float> own = good.parameters;
      own[i] = wrong;
      EXPECT_NE(good.kind->flaw(own), nullptr) << i << " " << wrong;
    }
}

}  // namespace
}  // namespace deltalux::surfaces
