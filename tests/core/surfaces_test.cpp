// SPDX-License-Identifier: Apache-2.0
// What holds for every kind of surface: paths, cells and chains mean the same reflectance, and a
// hit knows which point it met.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "ball.h"
#include "base/error.h"
#include "gather/cells/cells.h"
#include "memory_archive.h"
#include "session_world.h"
#include "striped.h"
#include "surfaces/kinds.h"
#include "trace/ray_caster.h"

namespace deltalux::surfaces {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(Surfaces, PathsCarryOnWhatIsReflected) {
  constexpr int kCount = 1 << 16;
  const Vec3f down = normalize(Vec3f{0.3f, -1, 0.2f});
  for (const Surface& surface : {Surface{{0.7f, 0.5f, 0.2f}}, striped({0.8f, 0.4f, 0.1f})})
    for (const float place : {0.25f, 0.75f})
      for (const float side : {1.0f, -1.0f}) {
        const SurfacePoint at{0.1f, 0.2f, {place, 0}};
        const Arrival arrival{down * side, {0, 2, 0}, at};
        Vec3d sum{}, most{};
        double cosines = 0;
        for (uint64_t path = 0; path < kCount; ++path) {
          Departure out;
          if (!surface.kind->scatter(surface, arrival, {1, path, 3}, out)) continue;
          EXPECT_EQ(out.normal, (Vec3f{0, side, 0}));
          EXPECT_GE(dot(out.normal, out.direction), 0);
          cosines += double(dot(out.normal, out.direction)) * out.throughput.x;
          sum = sum + out.throughput, most = max(most, out.throughput);
        }
        const Vec3f expected = surface.diffuse_at(at);
        const Vec3d bound = surface.kind->max_throughput(surface);
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(sum[c] / kCount, expected[c], 0.01 * expected[c]) << surface.kind->name();
          EXPECT_LE(most[c], bound[c] * (1 + 1e-7));
          EXPECT_LE(bound[c], 1);
          // As tight as can be said: of all points alike, or if one channel is the brightest.
          const bool alike = surface.kind->reads() == Reads::nothing;
          const double brightest = surface.kind->max_tint(surface)[c] * surface.reflectance[c];
          EXPECT_NEAR(bound[c], alike ? double(most[c]) : std::sqrt(brightest), 1e-7);
        }
        EXPECT_NEAR(cosines / sum.x, 2.0 / 3, 0.005);  // of a cosine-distributed direction
      }
}

std::string refusal(const auto& work) {
  try {
    work();
  } catch (const SceneError& error) {
    return error.what();
  }
  return {};
}

TEST(Surfaces, OfAnUnknownKindAreRefused) {
  EXPECT_EQ(&kind_named("diffuse"), &diffuse());
  const std::string found = refusal([] { kind_named("velvet"); });
  EXPECT_EQ(found.find("kind of surface: found \"velvet\", expected one of \"diffuse\""), 0u)
      << found;
}

/// A scene with a floor of 1 x 1 m, of one material.
scene::Scene floor(const Surface& surface, int pieces = 1) {
  scene::Scene scene;
  scene.materials = {surface};
  scene::Object object;
  object.name = "floor";
  direct::add_quad(object, {0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0, pieces);
  scene.objects = {object};
  return scene;
}

TEST(Surfaces, ThatASceneCannotHaveAreRefused) {
  scene::Scene scene = floor(striped({0.5f, 0.5f, 0.5f}));
  EXPECT_EQ(refusal([&] { scene.finish(); }), "");
  add_texture(scene.objects[0], 1);
  EXPECT_EQ(refusal([&] { scene.finish(); }), "");
  scene.objects[0].texture.pop_back();
  EXPECT_EQ(refusal([&] { scene.finish(); }),
            "mesh \"floor\": expected texture coordinates of each triangle, or none");
  add_texture(scene.objects[0], 1);
  scene.materials[0].parameters = {};
  EXPECT_EQ(refusal([&] { scene.finish(); }),
            "material \"stripes\": found other parameters than whether there are holes");
  scene.materials = {{{0.5f, 0.5f, 0.5f}}};
  scene.materials[0].parameters = {1};
  EXPECT_NE(refusal([&] { scene.finish(); }).find("parameters, which a diffuse"),
            std::string::npos);
}

TEST(Surfaces, AHitKnowsItsPoint) {
  scene::Scene scene = session::room();
  scene.objects[1].pose.row[0] = {0, 0, 1}, scene.objects[1].pose.row[2] = {-1, 0, 0};
  scene.materials[0] = striped({0.5f, 0.5f, 0.5f});
  for (scene::Object& object : scene.objects) add_texture(object, 0.7f);
  scene.finish();
  Progress progress;
  const trace::RayCaster caster(scene, progress);
  size_t moving = 0;
  for (uint32_t i = 0; i < 2000; ++i) {
    const PathRandom random(5, i);
    const Vec3f o{1.9f, 1.2f, 2.1f};
    const Vec3f w = normalize(Vec3f{random(0, 0) - 0.6f, random(0, 1) - 0.6f, random(0, 2) - 0.6f});
    const trace::Hit hit = caster.closest(o, w);
    ASSERT_TRUE(hit.valid());
    const scene::Object& object = scene.objects[scene.object_of(hit.primitive)];
    if (scene.material_index(hit.primitive) != 0) continue;
    moving += object.movable;
    const Vec3f local = object.pose.inverse().point(o + w * hit.t);
    const auto& t = object.triangles[hit.primitive - object.first_primitive];
    const Vec3f a = object.vertices[t[0]];
    const Vec3f by_corners =
        a + (object.vertices[t[1]] - a) * hit.u + (object.vertices[t[2]] - a) * hit.v;
    EXPECT_LT(length(by_corners - local), 1e-5f);
    const SurfacePoint at = scene.point_on(hit.primitive, hit.u, hit.v);
    EXPECT_NEAR(at.texture[0], 0.7f * (local.x + local.z), 1e-5f);
    EXPECT_NEAR(at.texture[1], 0.7f * local.y, 1e-5f);
  }
  EXPECT_GT(moving, 50u);
}

TEST(Surfaces, RaysPassThroughHoles) {
  scene::Scene scene = session::room();
  scene.materials.push_back(striped({0.5f, 0.5f, 0.5f}, true));
  scene::Object& walls = scene.objects[0];
  const uint32_t first = uint32_t(walls.triangles.size());
  direct::add_quad(walls, {1, 0.2f, 1}, {2, 0, 0}, {0, 2, 0}, 2);  // upright, at z = 1
  add_texture(walls, 1);
  scene.objects[1].present = false;
  scene.finish();
  Progress progress;
  const trace::RayCaster caster(scene, progress);
  trace::RayFan fan;
  fan.origin = {2, 1, 0.5f}, fan.to = 2;
  trace::RayBits wanted{};
  size_t passed = 0;
  for (uint32_t i = 0; i < trace::RayFan::kMaxRays; ++i) {
    const PathRandom random(6, i);
    const Vec3f to{1.1f + 1.8f * random(0, 0), 0.3f + 1.8f * random(0, 1), 1};
    const Vec3f w = to - fan.origin;
    const trace::Hit hit = caster.closest(fan.origin, w, 0, 2);
    const bool hole = to.y - std::floor(to.y) < 0.5f;
    EXPECT_EQ(hit.primitive == first || hit.primitive == first + 1, !hole) << to.y;
    EXPECT_EQ(caster.occluded(fan.origin, w, 1.2f), !hole) << to.y;
    fan.x[i] = w.x, fan.y[i] = w.y, fan.z[i] = w.z;
    wanted[i / 64] |= uint64_t(1) << (i % 64), ++fan.count;
    passed += hole;
  }
  EXPECT_GT(passed, 50u);
  fan.to = 1.2f;
  const trace::RayBits blocked = caster.occluded_static(fan, wanted);
  for (uint32_t i = 0; i < fan.count; ++i) {
    const Vec3f w{fan.x[i], fan.y[i], fan.z[i]};
    EXPECT_EQ(blocked[i / 64] >> (i % 64) & 1, caster.occluded(fan.origin, w, fan.to));
  }
}

TEST(Surfaces, CellsReflectTheMeanOfTheirPoints) {
  for (const int pieces : {1, 40}) {
    scene::Scene scene = floor(striped({0.5f, 0.5f, 0.5f}), pieces);
    // Dark for x + z from 0.5 to 1, and from 1.5.
    add_texture(scene.objects[0], 1);
    scene.finish();
    Progress progress;
    const gather::Cells cells(scene, trace::RayCaster(scene, progress), 1);
    double sum = 0, area = 0;
    for (uint32_t cell = 0; cell < cells.size(); ++cell) {
      EXPECT_GE(cells.tint(cell).x, Striped::kDark.x - 1e-6f);
      EXPECT_LE(cells.tint(cell).x, Striped::kBright.x + 1e-6f);
      EXPECT_NEAR(cells.tint(cell).z, 1, 1e-6);
      sum += double(cells.tint(cell).x) * cells.area(cell), area += cells.area(cell);
    }
    // The share of x + z < 0.5 is 1/8 of the square, that of 1 to 1.5 is 3/8.
    EXPECT_NEAR(sum / area, 0.5 * (double(Striped::kBright.x) + double(Striped::kDark.x)), 0.005);
    const gather::CellFinder finder(scene, cells);
    const Vec3f down{0, -1, 0};
    const auto share_under = [&](float x, float z) {
      const uint32_t primitive = pieces == 1 ? (x > z ? 1u : 0u) : 0u;
      return cells.tint(finder.find(primitive, {x, 1, z}, down, 1)).x;
    };
    EXPECT_FLOAT_EQ(share_under(0.01f, 0.012f), Striped::kBright.x);
    if (pieces == 1) {
      EXPECT_FLOAT_EQ(share_under(0.99f, 0.98f), Striped::kDark.x);
    }
  }
}

TEST(Surfaces, OfConstantReflectanceNeedNoShares) {
  scene::Scene scene = floor({{0.5f, 0.5f, 0.5f}});
  scene.finish();
  EXPECT_EQ(scene.tint_at(0, 0.3f, 0.3f), (Vec3f{1, 1, 1}));
  Progress progress;
  const gather::Cells cells(scene, trace::RayCaster(scene, progress), 1);
  for (uint32_t cell = 0; cell < cells.size(); ++cell)
    EXPECT_EQ(cells.tint(cell), (Vec3f{1, 1, 1}));
}

// Every point of a ball sees all others alike, so the irradiance inside is the same everywhere:
// that of the lamp in its middle over 1 - mean reflectance.
TEST(Surfaces, AStripedBallIsLitByTheMeanReflectance) {
  scene::Scene scene;
  const Vec3f reflectance{0.8f, 0.4f, 0.8f};
  scene.materials = {striped(reflectance)};
  scene.objects = {ball()};
  scene::PunctualLight lamp;
  lamp.name = "lamp";
  lamp.kind = &lights::kind_named("point");
  lamp.intensity = {1, 1, 1};
  scene.lights = {lamp};
  scene.finish();
  const samples::SampleSet samples = inside(scene.objects[0], 5);
  // Three quarters of a triangle are where the first coordinate is below a half.
  const Vec3d mean = Vec3d(Striped::kBright) * 0.75 + Vec3d(Striped::kDark) * 0.25;
  for (const uint32_t rays : {0u, 64u}) {
    session::Options options;
    options.paths = 60000, options.gather_rays = rays;
    session::Session session(scene, samples, options);
    Progress progress;
    session.bake(progress);
    std::vector<double> irradiance(3 * samples.size());
    session.read_irradiance(irradiance.data());
    for (int c = 0; c < 3; ++c) {
      double all = 0;
      for (size_t i = 0; i < samples.size(); ++i)
        all += irradiance[3 * i + size_t(c)] / double(samples.size());
      EXPECT_NEAR(all * (1 - double(reflectance[c]) * mean[c]), 1, 0.02) << c << " " << rays;
    }
  }
}

scene::Scene striped_room() {
  scene::Scene scene = session::room_with_spot();
  scene.materials[0] = striped({0.7f, 0.6f, 0.5f});
  scene.materials.push_back(striped({0.4f, 0.5f, 0.6f}, true));
  for (scene::Object& object : scene.objects) add_texture(object, 3.1f);
  for (size_t t = 0; t < 6; ++t) scene.objects[1].material[t] = 2;  // of the block
  scene.finish();
  return scene;
}

TEST(Surfaces, ThatVaryKeepUpdatesExact) {
  Progress progress;
  for (const bool gathers : {false, true}) {
    const session::Options options =
        gathers ? session::gathering(2)
                : session::options(2, session::DirectMode::sampled, segments::SegmentEnd::bounded);
    session::Session session(striped_room(), session::some_samples(), options);
    session.bake(progress);
    const std::vector<std::vector<scene::Edit>> steps = {
        {scene::Move{1, session::at(2.2, 2.1)}},
        {scene::SetPresent{1, false}, scene::Dim{0, 0.5}},
        {scene::SetPresent{1, true}, scene::SetReflectance{0, {0.3f, 0.4f, 0.5f}}},
        {scene::SetReflectance{0, {0.95f, 0.9f, 1}}},  // so bright that stripes lose contrast
        {scene::Move{1, session::at(3, 1)}, scene::SetReflectance{0, {0.1f, 0.9f, 1}}}};
    std::vector<double> light(3 * session::some_samples().size()), again(light.size());
    for (const auto& edits : steps) {
      session.update(edits, 0, progress);
      const auto updated = session.digest();
      session.read_irradiance(light.data());
      session.recompute(progress);
      session.read_irradiance(again.data());
      EXPECT_EQ(session.digest(), updated);
      EXPECT_EQ(light, again);
    }
    session::Session opened(striped_room(), session::some_samples(), options);
    MemoryArchive archive(session.save());
    opened.restore(archive, progress);
    EXPECT_EQ(opened.digest(), session.digest());
    opened.read_irradiance(light.data());
    EXPECT_EQ(light, again);
  }
}

// With a mean so high that the bright stripes would reflect more than they receive, stripes differ
// less: bright ones are white, and the mean is the same.
TEST(Surfaces, ThatAreTooBrightHaveLessContrast) {
  for (const float mean : {0.5f, 0.8f, 0.9f, 1.0f}) {
    const Surface surface = striped({mean, mean, mean});
    const Vec3f bright = surface.diffuse_at({0, 0, {0.2f, 0}});
    const Vec3f dark = surface.diffuse_at({0, 0, {0.7f, 0}});
    EXPECT_FLOAT_EQ(bright.x, std::min(1.0f, mean * Striped::kBright.x));
    // Both differ in proportion to their tints, so that the mean over all points stays.
    constexpr float kTints = (Striped::kBright.x - 1) / (1 - Striped::kDark.x);
    EXPECT_NEAR(bright.x - mean, kTints * (mean - dark.x), 1e-6);
    EXPECT_FLOAT_EQ(bright.z, mean);
    EXPECT_LE(surface.kind->max_throughput(surface).x, 1);
  }
}

}  // namespace
}  // namespace deltalux::surfaces
