// SPDX-License-Identifier: Apache-2.0
// Textures: where texels lie, what is between and beyond them, and what surfaces make of them.
#include "surfaces/texture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ball.h"
#include "base/random.h"
#include "session_world.h"
#include "striped.h"
#include "surfaces/textured.h"

namespace deltalux::surfaces {
namespace {

constexpr float kBlack = 0, kGrey = 0.21586053f, kWhite = 1;  // of the bytes 0, 128, 255
constexpr Sampler kRepeat{{Wrap::repeat, Wrap::repeat}, false};

Texture image(uint32_t width, const std::vector<Texture::Texel>& texels) {
  return {width, uint32_t(texels.size()) / width, texels};
}

/// A row of grey texels.
Texture row(std::initializer_list<uint8_t> greys) {
  std::vector<Texture::Texel> texels;
  for (const uint8_t grey : greys) texels.push_back({grey, grey, grey, 255});
  return image(uint32_t(texels.size()), texels);
}

Vec3f colour_at(const Texture& texture, float u, float v, const Sampler& sampler) {
  return texture.at(u, v, sampler).colour;
}

TEST(Texture, HasItsTexelsAtTheirCentres) {
  const Texture two_rows =
      image(2, {{255, 0, 0, 255}, {0, 255, 0, 255}, {0, 0, 255, 255}, {128, 128, 128, 255}});
  EXPECT_EQ(colour_at(two_rows, 0.25f, 0.25f, kRepeat), (Vec3f{1, 0, 0}));
  EXPECT_EQ(colour_at(two_rows, 0.75f, 0.25f, kRepeat), (Vec3f{0, 1, 0}));
  EXPECT_EQ(colour_at(two_rows, 0.25f, 0.75f, kRepeat), (Vec3f{0, 0, 1}));
  EXPECT_FLOAT_EQ(colour_at(two_rows, 0.75f, 0.75f, kRepeat).y, kGrey);
  EXPECT_FLOAT_EQ(colour_at(two_rows, 0.5f, 0.5f, kRepeat).y, (1 + kGrey) / 4);
  EXPECT_EQ(two_rows.brightest(), (Vec3f{1, 1, 1}));
  EXPECT_FLOAT_EQ(row({0, 128, 3}).brightest().x, kGrey);
}

TEST(Texture, IsLinearBetweenTexels) {
  const Texture texture = row({0, 128, 255, 0});
  for (const float share : {0.0f, 0.25f, 0.5f, 0.9f})
    EXPECT_NEAR(colour_at(texture, (1.5f + share) / 4, 0.3f, kRepeat).x,
                kGrey + share * (kWhite - kGrey), 1e-6);
}

TEST(Texture, GoesOnBeyondItsEdges) {
  const Texture texture = row({0, 128, 255});
  const auto at = [&](float u, Wrap wrap) {
    return colour_at(texture, u, 0, {{wrap, wrap}, false}).x;
  };
  // At the edge itself: between the last and the first, and of one alone.
  EXPECT_FLOAT_EQ(at(0, Wrap::repeat), 0.5f * (kWhite + kBlack));
  EXPECT_FLOAT_EQ(at(1, Wrap::repeat), 0.5f * (kWhite + kBlack));
  EXPECT_FLOAT_EQ(at(-1e-9f, Wrap::repeat), 0.5f * (kWhite + kBlack));
  for (const Wrap wrap : {Wrap::clamp, Wrap::mirror}) {
    EXPECT_FLOAT_EQ(at(0, wrap), kBlack);
    EXPECT_FLOAT_EQ(at(1, wrap), kWhite);
  }
  for (const float u : {0.1f, 0.4f, 0.55f, 0.96f})
    for (const int copy : {-7, -2, -1, 1, 2, 5}) {
      const float beyond = float(copy) + u;
      EXPECT_NEAR(at(beyond, Wrap::repeat), at(u, Wrap::repeat), 1e-5);
      EXPECT_NEAR(at(beyond, Wrap::mirror), at(copy % 2 ? 1 - u : u, Wrap::mirror), 1e-5);
      EXPECT_EQ(at(beyond, Wrap::clamp), copy < 0 ? kBlack : kWhite);
    }
}

// Every texel of an image that is no multiple of whatever blocks it may be stored in.
TEST(Texture, HasAllTexels) {
  std::vector<Texture::Texel> texels;
  for (uint32_t i = 0; i < 11 * 7; ++i)
    texels.push_back({uint8_t(3 * i), uint8_t(255 - i), 9, 255});
  const Texture texture = image(11, texels);
  for (uint32_t row = 0; row < 7; ++row)
    for (uint32_t column = 0; column < 11; ++column) {
      const Texture::Texel& own = texels[row * 11 + column];
      const Texture alone = image(1, {own});
      const float u = (float(column) + 0.5f) / 11, v = (float(row) + 0.5f) / 7;
      EXPECT_LT(length(colour_at(texture, u, v, kRepeat) - colour_at(alone, 0, 0, kRepeat)), 2e-5f);
      EXPECT_EQ(colour_at(texture, u, v, {{}, true}), colour_at(alone, 0, 0, kRepeat));
    }
}

TEST(Texture, MayShowTheNearestTexel) {
  const Texture texture = row({0, 128, 255});
  const auto at = [&](float u) {
    return colour_at(texture, u, 0.99f, {{Wrap::repeat, Wrap::clamp}, true}).x;
  };
  EXPECT_EQ(at(0), kBlack);
  EXPECT_EQ(at(0.33f), kBlack);
  EXPECT_FLOAT_EQ(at(0.34f), kGrey);
  EXPECT_FLOAT_EQ(at(0.66f), kGrey);
  EXPECT_EQ(at(0.67f), kWhite);
  EXPECT_EQ(at(-0.1f), kWhite);
  EXPECT_EQ(at(1), kBlack);
}

TEST(Texture, IsReadAnywhere) {
  const Texture texture = row({0, 128, 255, 7, 9});
  for (const float far : {1e4f, -3e7f, 1e20f, -1e38f})
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror})
      for (const bool nearest : {false, true}) {
        const float found = colour_at(texture, far, -far, {{wrap, wrap}, nearest}).x;
        EXPECT_GE(found, 0) << far;
        EXPECT_LE(found, 1) << far;
      }
}

/// A checker of texels, half of them white, whose mean is half of the reflectance of its white.
Surface checkered(Vec3f reflectance, bool nearest = true) {
  TextureMap map;
  map.texture = std::make_shared<Texture>(
      image(2, {{255, 255, 255, 255}, {0, 0, 255, 255}, {0, 0, 255, 255}, {255, 255, 255, 255}}));
  map.sampler.nearest = nearest;
  map.matrix = {{{2, 0, 0.25f}, {0, -3, 0.5f}}};
  map.gain = {2, 2, 1};
  return textured({reflectance, {}, false, &diffuse(), {}, "checker"}, map);
}

TEST(Texture, TintsSurfacesByItsPlaceOnThem) {
  const Surface surface = checkered({0.4f, 0.3f, 0.2f});
  EXPECT_EQ(surface.kind->name(), "textured");
  EXPECT_EQ(surface.diffuse_at({0, 0, {0, 0}}), (Vec3f{0, 0, 0.2f}));  // at (0.25, 0.5)
  EXPECT_EQ(surface.diffuse_at({0, 0, {0, 0.01f}}), (Vec3f{0.8f, 0.6f, 0.2f}));
  EXPECT_EQ(surface.diffuse_at({0, 0, {0.13f, 0.01f}}), (Vec3f{0, 0, 0.2f}));
  EXPECT_EQ(surface.contrast(), (Vec3f{1, 1, 1}));
  EXPECT_EQ(surface.kind->max_tint(surface), (Vec3f{2, 2, 1}));
}

TEST(Texture, IsItsMeanWithoutCoordinates) {
  const Surface surface = checkered({0.4f, 0.3f, 0.2f});
  const float none = std::nanf("");
  for (const std::array<float, 2> at : {std::array{none, 0.5f}, {0.5f, none}, {INFINITY, 0.5f}})
    EXPECT_EQ(surface.diffuse_at({0, 0, at}), surface.reflectance);
  scene::Scene scene = session::room();
  scene.materials[0] = surface;
  scene.finish();
  EXPECT_EQ(scene.tint_at(0, 0.2f, 0.3f), (Vec3f{1, 1, 1}));
  add_texture(scene.objects[0], 0.1f);
  scene.finish();
  EXPECT_NE(scene.tint_at(0, 0.2f, 0.3f), (Vec3f{1, 1, 1}));
}

// What is half transparent counts by half: the rest has the mean, so that the mean stays.
TEST(Texture, CountsByItsWeight) {
  TextureMap map;
  map.texture =
      std::make_shared<Texture>(image(3, {{255, 255, 255, 255}, {0, 0, 0, 51}, {255, 9, 9, 0}}));
  map.sampler.nearest = true;
  const float mean = 1 / 1.2f;  // weighted
  map.gain = {1 / mean, 1 / mean, 1 / mean};
  const Surface surface = textured({{0.5f, 0.5f, 0.5f}}, map);
  const auto at = [&](float u) { return surface.diffuse_at({0, 0, {u, 0.5f}}).x; };
  EXPECT_FLOAT_EQ(at(0.1f), 0.5f * 1.2f);
  EXPECT_FLOAT_EQ(at(0.5f), 0.5f * 0.8f);
  EXPECT_FLOAT_EQ(at(0.9f), 0.5f);
  EXPECT_FLOAT_EQ(at(0.1f) + at(0.5f) + at(0.9f), 1.5f);
  EXPECT_FLOAT_EQ(surface.kind->max_tint(surface).x, 1.2f);
  map.texture = std::make_shared<Texture>(image(1, {{255, 9, 9, 0}}));
  const Surface hidden = textured({{0.5f, 0.5f, 0.5f}}, map);
  EXPECT_EQ(hidden.kind->max_tint(hidden), (Vec3f{1, 1, 1}));
  EXPECT_EQ(hidden.diffuse_at({0, 0, {0.3f, 0.2f}}), hidden.reflectance);
}

TEST(Texture, OfBlackCountsAsItsSurface) {
  TextureMap map;
  map.texture = std::make_shared<Texture>(image(1, {{0, 128, 255, 255}}));
  map.gain = {0, 1 / kGrey, 1};
  const Surface surface = textured({{0.3f, 0.4f, 0.5f}}, map);
  EXPECT_LT(length(surface.diffuse_at({0, 0, {0.3f, 0.2f}}) - surface.reflectance), 1e-6f);
  EXPECT_LT(length(surface.kind->max_tint(surface) - Vec3f{1, 1, 1}), 1e-6f);
}

TEST(Texture, KeepsUpdatesExact) {
  Progress progress;
  scene::Scene room = session::room_with_spot();
  room.materials[0] = checkered({0.35f, 0.3f, 0.5f}, false);
  for (scene::Object& object : room.objects) add_texture(object, 0.8f);
  room.finish();
  session::Session session(room, session::some_samples(), session::gathering(2));
  session.bake(progress);
  const std::vector<std::vector<scene::Edit>> steps = {
      {scene::Move{1, session::at(2.2, 2.1)}},
      {scene::SetPresent{1, false}, scene::SetReflectance{0, {0.8f, 0.4f, 0.5f}}},
      {scene::SetPresent{1, true}},
      {scene::Move{1, session::at(3, 1)}, scene::SetReflectance{0, {0.35f, 0.3f, 0.5f}}}};
  std::vector<double> updated(3 * session::some_samples().size()), again(updated.size());
  for (const auto& edits : steps) {
    session.update(edits, 0, progress);
    const auto digest = session.digest();
    session.read_irradiance(updated.data());
    session.recompute(progress);
    session.read_irradiance(again.data());
    EXPECT_EQ(session.digest(), digest);
    EXPECT_EQ(updated, again);
  }
}

}  // namespace
}  // namespace deltalux::surfaces
