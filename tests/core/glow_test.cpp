// SPDX-License-Identifier: Apache-2.0
// Parts of luminous triangles hold the light of the texels on them, wherever those lie.
#include "trace/glow.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surfaces/texture.h"

namespace deltalux::trace {
namespace {

using surfaces::Texture;
using Uv = std::array<float, 2>;

/// Two triangles of a square of 2 m with corners at these places of the image, and what they emit.
struct Card {
  scene::Object object;
  scene::Material material;

  Card(std::shared_ptr<const Texture> texture, bool nearest, const std::array<Uv, 4>& at,
       surfaces::Wrap wrap = surfaces::Wrap::repeat) {
    object.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 0, 2}, {0, 0, 2}};
    object.triangles = {{0, 1, 2}, {0, 2, 3}};
    object.texture = {{at[0], at[1], at[2]}, {at[0], at[2], at[3]}};
    surfaces::TextureMap map;
    map.texture = std::move(texture), map.sampler = {{wrap, wrap}, nearest},
    map.gain = {10, 20, 30};
    material.glow = std::make_shared<const surfaces::TextureMap>(map);
    material.emission = {1, 2, 3};
  }
  std::vector<LightPart> divide() const {
    std::vector<LightPart> parts;
    for (uint32_t t = 0; t < object.triangles.size(); ++t) {
      const auto& [a, b, c] = object.triangles[t];
      parts.push_back({t, {object.vertices[a], object.vertices[b], object.vertices[c]}});
    }
    return divided_by_glow(object, material, parts);
  }
};

double area_of(std::span<const LightPart> parts) {
  double sum = 0;
  for (const LightPart& part : parts) sum += part.area();
  return sum;
}

Vec3d power_of(std::span<const LightPart> parts) {
  Vec3d sum{};
  for (const LightPart& part : parts) sum = sum + Vec3d(part.radiance) * part.area();
  return sum;
}

/// Grey texels that differ; a third of them black.
std::vector<Texture::Texel> texels(size_t count) {
  std::vector<Texture::Texel> out;
  for (size_t i = 0; i < count; ++i) {
    const auto grey = uint8_t(i % 3 ? i * 7919 % 256 : 0);
    out.push_back({grey, grey, grey, 255});
  }
  return out;
}

double mean_of(std::span<const Texture::Texel> own) {
  double sum = 0;
  for (const Texture::Texel& texel : own) {
    const double s = texel[0] / 255.0;
    sum += s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  }
  return sum / double(own.size());
}

std::array<Uv, 4> covering(float across, float down) {
  return {{{0, 0}, {across, 0}, {across, down}, {0, down}}};
}

TEST(Glow, HasThePowerOfItsTexels) {
  for (const auto& [width, height] : {std::array{1u, 1u}, {5u, 3u}, {64u, 40u}, {700u, 500u}}) {
    const auto own = texels(size_t(width) * height);
    const auto texture = std::make_shared<const Texture>(width, height, own);
    for (const bool nearest : {true, false})
      for (const float times : {1.0f, 3.0f}) {
        const auto parts = Card(texture, nearest, covering(times, times)).divide();
        const Vec3d power = power_of(parts), expected = Vec3d{10, 20, 30} * (4 * mean_of(own));
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(power[c], expected[c], 1e-5 * expected[c]) << width << " " << nearest;
        EXPECT_LE(parts.size(), 512u);
        EXPECT_LE(area_of(parts), 4 + 1e-5);
      }
  }
}

/// One white square of 2 x 2 texels in each `pitch` of a black image.
std::shared_ptr<const Texture> sparse(uint32_t size, uint32_t pitch) {
  std::vector<Texture::Texel> own;
  for (uint32_t row = 0; row < size; ++row)
    for (uint32_t column = 0; column < size; ++column) {
      const auto grey = uint8_t(row % pitch < 2 && column % pitch < 2 ? 255 : 0);
      own.push_back({grey, grey, grey, 255});
    }
  return std::make_shared<const Texture>(size, size, own);
}

// Places that are spread alike in each part would all meet the dots, or none.
TEST(Glow, OfManyTilesHasTheirMean) {
  struct Case {
    uint32_t size, pitch;
    float times;
  };
  for (const Case& own : {Case{64, 64, 64},
                          {64, 64, 256},
                          {64, 64, 512},
                          {64, 64, 1e5f},
                          {512, 16, 4},
                          {512, 8, 7.3f},
                          {63, 63, 100},
                          {1, 1, 3e6f}})
    for (const auto wrap : {surfaces::Wrap::repeat, surfaces::Wrap::mirror}) {
      const bool nearest = own.times > 100;
      const auto texture = sparse(own.size, own.pitch);
      const double mean = own.size == 1 ? 1 : 4.0 / (double(own.pitch) * own.pitch);
      const Vec3d power =
          power_of(Card(texture, nearest, covering(own.times, own.times), wrap).divide());
      EXPECT_NEAR(power.x, 40 * mean, 0.02 * 40 * mean) << own.size << " " << own.times;
    }
}

TEST(Glow, OfSliversInTheImageEnds) {
  const auto texture = std::make_shared<const Texture>(8, 8, texels(64));
  for (const float far : {1e5f, 1e9f, 1e17f, 3e38f}) {
    const auto parts =
        Card(texture, false, {{{far, 0}, {1.1f * far, 0}, {far, 1 / far}, {0, 0}}}).divide();
    for (const LightPart& part : parts)
      for (int c = 0; c < 3; ++c) EXPECT_TRUE(part.radiance[c] >= 0 && part.radiance[c] <= 30);
  }
}

TEST(Glow, OfNothingIsNoLight) {
  const Texture::Texel black{0, 0, 0, 255};
  const auto texture = std::make_shared<const Texture>(1, 1, std::span(&black, 1));
  EXPECT_TRUE(Card(texture, false, covering(1, 1)).divide().empty());
}

TEST(Glow, WithoutAreaInTheImageIsThatOfTheTexel) {
  const std::array<Texture::Texel, 2> own{{{255, 255, 255, 255}, {0, 0, 0, 255}}};
  const auto texture = std::make_shared<const Texture>(2, 1, own);
  const Uv at{0.25f, 0.5f};
  const auto parts = Card(texture, true, {at, at, at, at}).divide();
  ASSERT_EQ(parts.size(), 2u);
  for (const LightPart& part : parts) EXPECT_EQ(part.radiance, (Vec3f{10, 20, 30}));
}

TEST(Glow, WithoutCoordinatesIsTheMean) {
  const auto texture = std::make_shared<const Texture>(8, 8, texels(64));
  Card card(texture, false, covering(1, 1));
  card.object.texture[1][2][0] = std::nanf("");
  const auto half = card.divide();
  EXPECT_GT(half.size(), 2u);
  for (const LightPart& part : half)
    if (part.triangle == 1) EXPECT_EQ(part.radiance, (Vec3f{1, 2, 3}));
  card.object.texture.clear();
  const auto parts = card.divide();
  ASSERT_EQ(parts.size(), 2u);
  for (const LightPart& part : parts) EXPECT_EQ(part.radiance, (Vec3f{1, 2, 3}));
}

TEST(Glow, OfAnEvenImageIsNotDivided) {
  const std::vector<Texture::Texel> own(100 * 100, {188, 188, 188, 255});
  const auto texture = std::make_shared<const Texture>(100, 100, own);
  EXPECT_EQ(Card(texture, false, covering(2, 2)).divide().size(), 2u);
}

}  // namespace
}  // namespace deltalux::trace
