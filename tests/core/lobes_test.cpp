// SPDX-License-Identifier: Apache-2.0
// Surfaces that are not diffuse: light that they send on is counted once, by whatever way it comes,
// and edits leave the bits of a recompute.
#include <gtest/gtest.h>

#include <cmath>

#include "ball.h"
#include "base/error.h"
#include "memory_archive.h"
#include "mirror.h"
#include "session_world.h"

namespace deltalux::session {
namespace {

scene::PunctualLight lamp_at(Vec3d position) {
  scene::PunctualLight lamp;
  lamp.name = "lamp";
  lamp.kind = &lights::kind_named("point");
  lamp.intensity = {100, 80, 60};
  lamp.position = position;
  return lamp;
}

samples::SampleSet on_floor(int count, Vec3f from, Vec3f step, float radius) {
  samples::SampleSet samples;
  for (int i = 0; i < count; ++i) {
    samples.point.push_back(from + step * float(i));
    samples.normal.push_back({0, 1, 0});
    samples.attached.push_back(scene::kNone);
    samples.radius.push_back(radius);
  }
  return samples;
}

struct Light {
  std::vector<double> irradiance, error;
};

Light read(const Session& session) {
  const size_t n = session.state().samples.size();
  Light out{std::vector<double>(3 * n), std::vector<double>(3 * n)};
  session.read(out.irradiance.data(), out.error.data());
  return out;
}

// Every point of a ball sees all others alike, in mirrors as in diffuse surfaces: the irradiance is
// that of the lamp in its middle over 1 - reflectance.
TEST(Lobes, ABallIsLitAlikeWhateverItsLobes) {
  for (const float mirrored : {0.3f, 0.7f})
    for (const uint32_t rays : {0u, 256u}) {
      scene::Scene scene;
      scene.materials = {surfaces::mirror({0.8f, 0.6f, 0.4f}, mirrored)};
      scene.objects = {ball(48)};
      scene.lights = {lamp_at({0, 0, 0})};
      scene.finish();
      samples::SampleSet samples;
      const scene::Object& object = scene.objects[0];
      for (size_t t = 7; t < object.triangles.size(); t += 20) {
        Vec3f sum{};
        for (const uint32_t v : object.triangles[t]) sum = sum + object.vertices[v];
        samples.point.push_back(sum * (1.0f / 3));
        samples.normal.push_back(-normalize(sum));
        samples.attached.push_back(scene::kNone);
        samples.radius.push_back(0.05f);
      }
      Options options;
      options.paths = 60000, options.gather_rays = rays;
      Session session(scene, samples, options);
      Progress progress;
      session.bake(progress);
      const Light light = read(session);
      const double given[3] = {100, 80, 60};
      for (int c = 0; c < 3; ++c) {
        double all = 0;
        for (size_t i = 0; i < samples.size(); ++i)
          all += light.irradiance[3 * i + size_t(c)] / double(samples.size());
        const double reflectance = double(scene.materials[0].reflectance[c]);
        EXPECT_NEAR(all / given[c] * (1 - reflectance), 1, 0.02)
            << c << " " << rays << " " << mirrored;
      }
    }
}

/// A black floor of 4 x 4 m with a mirror on a side, 3 m high.
scene::Scene floor_and_mirror() {
  scene::Scene scene;
  scene.materials = {{}, surfaces::mirror({0.9f, 0.8f, 0.7f})};
  scene::Object floor;
  floor.name = "floor";
  direct::add_quad(floor, {0, 0, 0}, {0, 0, 4}, {4, 0, 0}, 0);
  direct::add_quad(floor, {0, 0, 0}, {0, 3, 0}, {0, 0, 4}, 1);
  scene.objects = {floor};
  scene.lights = {lamp_at({1, 2, 2})};
  scene.finish();
  return scene;
}

// A mirror is a second lamp behind it. Null hypothesis: |error| below four claimed ones; false
// alarms: of 3 x 12 values about 0.3 %, with a floor of 1 %.
TEST(Lobes, AMirrorShowsTheLampsImage) {
  for (const uint32_t rays : {0u, 64u}) {
    Options options;
    options.paths = 400000, options.gather_rays = rays, options.direct = DirectMode::sampled;
    const samples::SampleSet samples = on_floor(12, {0.5f, 0, 1.3f}, {0.2f, 0, 0.05f}, 0.1f);
    Session session(floor_and_mirror(), samples, options);
    Progress progress;
    session.bake(progress);
    const Light light = read(session);
    for (size_t i = 0; i < samples.size(); ++i) {
      const Vec3d at(samples.point[i]);
      const auto from = [&](Vec3d lamp) {
        const Vec3d way = lamp - at;
        return way.y / std::pow(dot(way, way), 1.5);
      };
      const double given[3] = {100, 80, 60}, mirrored[3] = {0.9, 0.8, 0.7};
      for (size_t c = 0; c < 3; ++c) {
        const double expected = given[c] * (from({1, 2, 2}) + mirrored[c] * from({-1, 2, 2}));
        EXPECT_NEAR(light.irradiance[3 * i + c], expected,
                    4 * light.error[3 * i + c] + 0.01 * expected)
            << i << " " << rays;
      }
    }
  }
}

// Discs count all light in the one, gather rays most of it in the other. Null hypothesis: equal
// means; the differences' standard error is below 0.4 % of the mean, so that 2 % is five of them.
TEST(Lobes, AGatherFindsWhatPathsBring) {
  const auto mean_of = [](uint32_t rays) {
    Options options;
    options.paths = 1'000'000, options.gather_rays = rays, options.direct = DirectMode::sampled;
    samples::SampleSet samples;
    for (const float z : {0.4f, 1.2f, 2.0f, 2.8f, 3.6f}) {
      const samples::SampleSet row = on_floor(16, {0.2f, 0, z}, {0.24f, 0, 0}, 0.1f);
      samples.point.insert(samples.point.end(), row.point.begin(), row.point.end());
      samples.normal.insert(samples.normal.end(), row.normal.begin(), row.normal.end());
      samples.attached.insert(samples.attached.end(), row.attached.begin(), row.attached.end());
      samples.radius.insert(samples.radius.end(), row.radius.begin(), row.radius.end());
    }
    scene::Scene scene = room_with_mirrors();
    scene.objects[1].pose = at(1.6, 1.5);
    scene.objects[1].pose.translation.y = 0.35;  // close to the floor: near hits
    scene.finish();
    Session session(scene, samples, options);
    Progress progress;
    session.bake(progress);
    const Light light = read(session);
    std::array<double, 3> mean{};
    for (size_t i = 0; i < light.irradiance.size(); ++i)
      mean[i % 3] += light.irradiance[i] * 3 / double(light.irradiance.size());
    return mean;
  };
  const auto by_paths = mean_of(0), gathered = mean_of(1024);
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(gathered[c] / by_paths[c], 1, 0.02) << c;
}

TEST(Lobes, UpdatesEqualRecomputes) {
  Progress progress;
  for (const bool gathers : {false, true}) {
    Options chosen =
        gathers ? gathering(2) : options(2, DirectMode::sampled, segments::SegmentEnd::bounded);
    Session session(room_with_mirrors(), some_samples(), chosen);
    session.bake(progress);
    const std::vector<double> before = read(session).irradiance;
    const std::vector<std::vector<scene::Edit>> steps = {
        {scene::Move{1, at(2.2, 2.1)}},
        {scene::SetPresent{1, false}, scene::Dim{0, 0.5}},
        {scene::SetPresent{1, true}, scene::SetReflectance{2, {0.3f, 0.4f, 0.5f}}},
        {scene::SetReflectance{3, {0.9f, 0.1f, 0.2f}}, scene::Move{1, at(3, 1)}},
        {scene::Insert{second_lamp()}}};
    for (const auto& edits : steps) {
      session.update(edits, 0, progress);
      const auto updated = session.digest();
      const std::vector<double> light = read(session).irradiance;
      session.recompute(progress);
      EXPECT_EQ(session.digest(), updated);
      EXPECT_EQ(read(session).irradiance, light);
      EXPECT_NE(light, before);
    }
    session.update(std::vector<scene::Edit>{scene::Move{1, at(1, 1)}}, 0.001, progress);
    for (int more = 0; session.pending_share() > 0; ++more) {
      ASSERT_LT(more, 10000);
      session.update({}, 0.5, progress);
    }
    const auto updated = session.digest();
    session.recompute(progress);
    EXPECT_EQ(session.digest(), updated);
  }
}

TEST(Lobes, FilesKeepThemAndRefuseOthers) {
  Progress progress;
  for (const bool gathers : {false, true}) {
    const Options chosen =
        gathers ? gathering(1) : options(1, DirectMode::sampled, segments::SegmentEnd::first);
    Session session(room_with_mirrors(), some_samples(), chosen);
    session.bake(progress);
    const ArchiveView view = session.save();
    Session opened(room_with_mirrors(), some_samples(), chosen);
    MemoryArchive archive(view), damaged(view);
    opened.restore(archive, progress);
    EXPECT_EQ(opened.digest(), session.digest());
    EXPECT_EQ(read(opened).irradiance, read(session).irradiance);
    const std::vector<scene::Edit> edits = {scene::Move{1, at(2.2, 2.1)}};
    session.update(edits, 0, progress), opened.update(edits, 0, progress);
    EXPECT_EQ(opened.digest(), session.digest());
    if (!gathers) continue;
    damaged.arrays.at("level1.history")[0] = std::byte{3};
    Session third(room_with_mirrors(), some_samples(), chosen);
    EXPECT_THROW(third.restore(damaged, progress), FormatError);
  }
}

}  // namespace
}  // namespace deltalux::session
