// SPDX-License-Identifier: Apache-2.0
// A small session through every kind of edit: what the sanitizers see of baking and updating.
#include "session/session.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "base/error.h"
#include "memory_archive.h"
#include "session_world.h"

namespace deltalux::session {
namespace {

TEST(Session, UpdatesEqualARecompute) {
  for (const DirectMode direct : {DirectMode::paths, DirectMode::sampled})
    for (const auto end : {segments::SegmentEnd::first, segments::SegmentEnd::bounded}) {
      Progress progress;
      Session session(room(), some_samples(), options(2, direct, end));
      session.bake(progress);
      const auto baked = session.digest();
      const std::vector<std::vector<scene::Edit>> steps = {
          {scene::Move{1, at(2.5, 2)}},
          {scene::SetPresent{1, false}, scene::Dim{0, 0.5}},
          {scene::SetPresent{1, true}, scene::SetReflectance{0, {0.3f, 0.4f, 0.5f}}},
          {scene::Insert{second_lamp()}},
          {scene::Move{2, at(1, 3)}, scene::Move{1, at(3, 1)}}};
      for (const auto& edits : steps) {
        session.update(edits, 0, progress);
        const auto updated = session.digest();
        EXPECT_NE(updated, baked);
        session.recompute(progress);
        EXPECT_EQ(session.digest(), updated);
      }
    }
}

TEST(Session, SpotsMoveWithWhatCarriesThem) {
  for (const float outer : {0.003f, 0.6f})
    for (const Options& chosen :
         {options(1, DirectMode::paths, segments::SegmentEnd::first),
          options(2, DirectMode::sampled, segments::SegmentEnd::bounded), gathering(1)}) {
      scene::Scene scene = room_with_spot();
      scene.lights[0].parameters[1] = outer;
      scene.lights[0].position = {0, 1.5, 0}, scene.lights[0].attached = 1;
      scene.finish();
      Progress progress;
      Session session(scene, some_samples(), chosen);
      session.bake(progress);
      Pose tilted = at(2.5, 2);
      tilted.row[0] = {0.8, -0.6, 0}, tilted.row[1] = {0.6, 0.8, 0};
      for (const scene::Edit& edit :
           std::vector<scene::Edit>{scene::Move{1, at(2.5, 2)}, scene::Move{1, tilted},
                                    scene::SetPresent{1, false}, scene::SetPresent{1, true}}) {
        session.update(std::vector<scene::Edit>{edit}, 0, progress);
        const auto updated = session.digest();
        const Vec3f at = session.state().lights[0].punctual.position;
        const Pose& pose = session.state().scene.objects[1].pose;
        EXPECT_LT(length(at - pose.point({0, 1.5f, 0})), 1e-6f);
        session.recompute(progress);
        EXPECT_EQ(session.digest(), updated);
      }
    }
}

TEST(Session, LampsGoAndComeBack) {
  Progress progress;
  Session session(room(), some_samples(),
                  options(2, DirectMode::paths, segments::SegmentEnd::first));
  session.bake(progress);
  // Without a recompute in between: slots of paths that have no segments meanwhile go to others.
  const std::vector<std::vector<scene::Edit>> steps = {
      {scene::Insert{second_lamp()}},
      {scene::SetPresent{2, false}},
      {scene::Move{1, at(2.5, 2)}},
      {scene::SetReflectance{0, {0.8f, 0.7f, 0.6f}}},
      {scene::SetPresent{2, true}}};
  for (const auto& edits : steps) session.update(edits, 0, progress);
  const auto updated = session.digest();
  session.recompute(progress);
  EXPECT_EQ(session.digest(), updated);
}

TEST(Session, ThreadsDoNotMatter) {
  std::vector<std::array<uint64_t, 4>> digests;
  for (const int threads : {1, 2, 4}) {
    Progress progress;
    Session session(room(), some_samples(),
                    options(threads, DirectMode::automatic, segments::SegmentEnd::first));
    session.bake(progress);
    session.update(std::vector<scene::Edit>{scene::Move{1, at(2, 2)}}, 0, progress);
    digests.push_back(session.digest());
  }
  EXPECT_EQ(digests[0], digests[1]);
  EXPECT_EQ(digests[0], digests[2]);
}

TEST(Session, GathersTheSameByAnyNumberOfThreads) {
  const std::vector<std::vector<scene::Edit>> steps = {
      {scene::Move{1, at(2.2, 2.1)}},  // into the beam
      {scene::SetPresent{1, false}, scene::Dim{0, 0.5}},
      {scene::SetPresent{1, true}, scene::SetReflectance{0, {0.3f, 0.4f, 0.5f}}},
      {scene::Insert{second_lamp()}},
      {scene::Move{2, at(1, 3)}, scene::Move{1, at(3, 1)}}};
  std::vector<std::array<uint64_t, 4>> digests[4];
  for (const int threads : {1, 2, 3, 4}) {
    Progress progress;
    Session session(room_with_spot(), some_samples(), gathering(threads));
    session.bake(progress);
    EXPECT_EQ(session.state().rays.guiding.beams.size(), 1u);
    for (const auto& edits : steps) {
      // Some rays wait for the next call.
      session.update(edits, 0.05, progress);
      while (session.update({}, 0.05, progress).done < 1) continue;
      digests[threads - 1].push_back(session.digest());
      if (threads > 2) continue;
      session.recompute(progress);
      EXPECT_EQ(session.digest(), digests[threads - 1].back());
    }
    EXPECT_EQ(digests[threads - 1], digests[0]);
  }
}

TEST(Session, ComesBackFromItsArchive) {
  Progress progress;
  const Options chosen = options(1, DirectMode::sampled, segments::SegmentEnd::first);
  Session session(room(), some_samples(), chosen), opened(room(), some_samples(), chosen);
  session.bake(progress);
  session.update(std::vector<scene::Edit>{scene::Move{1, at(2, 2)}}, 0, progress);
  MemoryArchive archive(session.save());
  opened.restore(archive, progress);
  EXPECT_EQ(opened.digest(), session.digest());
  for (Session* each : {&session, &opened})
    each->update(std::vector<scene::Edit>{scene::Move{1, at(1, 3)}}, 0, progress);
  EXPECT_EQ(opened.digest(), session.digest());
}

TEST(Session, CancelledCallsLeaveItValid) {
  Progress progress, stopped;
  stopped.cancel();
  Session session(room(), some_samples(),
                  options(2, DirectMode::sampled, segments::SegmentEnd::first));
  EXPECT_THROW(session.bake(stopped), Cancelled);
  session.bake(progress);
  const auto baked = session.digest();
  EXPECT_THROW(session.recompute(stopped), Cancelled);
  EXPECT_EQ(session.digest(), baked);
}

// The ray library may bind oneTBB for the whole process when asked for one thread.
TEST(RayCaster, LeavesOtherThreadsAlone) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "built to use one thread under ThreadSanitizer";
#endif
  const auto allowed = [] {
    return tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  };
  const size_t before = allowed();
  Progress progress;
  const trace::RayCaster caster(room(), progress);
  EXPECT_EQ(allowed(), before);
}

}  // namespace
}  // namespace deltalux::session
