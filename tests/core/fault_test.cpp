// SPDX-License-Identifier: Apache-2.0
// The k-th allocation, acceleration structure or look at the cancel flag fails, for every k of each
// operation of a session: afterwards it is as before or after, and the next update is right.
//
// With DELTALUX_FAULT_ALL in the environment every k up to 2,000 is tried (an hour), otherwise all
// of them in the plainest session alone, and some in the others.
#include "base/fault.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <new>

#include "base/error.h"
#include "memory_archive.h"
#include "session_world.h"

// Sanitizers bring allocators of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DELTALUX_FAULTY_NEW

namespace {
std::atomic<int64_t> allocations_left = 0;  // 0 = all succeed

void* allocate(std::size_t bytes, std::size_t alignment) {
  if (allocations_left.load(std::memory_order_relaxed) > 0 && allocations_left.fetch_sub(1) == 1)
    throw std::bad_alloc();
  const std::size_t whole = (bytes + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, std::max(whole, alignment));
  if (!memory) throw std::bad_alloc();
  return memory;
}
}  // namespace

void* operator new(std::size_t bytes) { return allocate(bytes, alignof(std::max_align_t)); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes, std::size_t(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
#endif

namespace deltalux::session {
namespace {

using Digest = std::array<uint64_t, 4>;

std::vector<double> light_of(const Session& session) {
  const size_t values = 3 * session.state().samples.size();
  std::vector<double> light(2 * values);
  session.read(light.data(), light.data() + values);
  return light;
}

struct Operation {
  const char* name;
  std::function<void(Session&, Progress&)> run;
};

std::vector<double> gradient_of(Session& session, Progress& progress) {
  std::vector<double> gradient(9 * session.state().samples.size());
  session.read_gradient(gradient.data(), progress);
  return gradient;
}

std::function<void(Session&, Progress&)> update_with(scene::Edit edit) {
  return [edit](Session& session, Progress& progress) {
    session.update(std::vector<scene::Edit>{edit}, 0, progress);
  };
}

const std::vector<Operation>& operations() {
  static const std::vector<Operation> all = {
      {"bake", [](Session& s, Progress& p) { s.bake(p); }},
      {"recompute", [](Session& s, Progress& p) { s.recompute(p); }},
      {"move", update_with(scene::Move{1, at(2.5, 2)})},
      {"remove", update_with(scene::SetPresent{1, false})},
      {"dim", update_with(scene::Dim{0, 0.5})},
      {"set_reflectance", update_with(scene::SetReflectance{0, {0.8f, 0.4f, 0.5f}})},
      {"insert", update_with(scene::Insert{second_lamp()})},
      {"insert a light group", update_with(scene::Insert{lamp_of_a_new_group()})},
      {"read", [](Session& s, Progress&) { light_of(s); }},
      {"gradient", [](Session& s, Progress& p) { gradient_of(s, p); }},
      {"save and open", [](Session& s, Progress& p) {
         MemoryArchive archive(s.save());
         Session opened(room(), some_samples(), s.state().options);
         opened.restore(archive, p);
       }}};
  return all;
}

/// A kind of failure: how to have the k-th, and how many were left before it; <= 0: it has come.
struct Fault {
  const char* name;
  std::function<void(int64_t)> arm;  // 0 = none
  std::function<int64_t()> left;
};

const std::vector<Fault>& faults() {
  using fault::Kind;
  const auto counted = [](const char* name, Kind kind) {
    return Fault{name, [kind](int64_t k) { fault::arm(kind, k); },
                 [kind] { return fault::countdown[size_t(kind)].load(); }};
  };
  static const std::vector<Fault> all = {
#ifdef DELTALUX_FAULTY_NEW
      {"allocation", [](int64_t k) { allocations_left = k; },
       [] { return allocations_left.load(); }},
#endif
      counted("acceleration structure", Kind::commit),
      counted("cancelled", Kind::cancel)};
  return all;
}

bool all_of_them() { return std::getenv("DELTALUX_FAULT_ALL"); }

Options small(int threads, uint32_t gather_rays) {
  Options out = options(threads, DirectMode::automatic, segments::SegmentEnd::first);
  out.paths = 64;
  out.gather_rays = gather_rays;
  return out;
}

/// How many times the fault could come: to tell which of them to try.
int64_t count(const Operation& operation, const Fault& fault, Session& session) {
  constexpr int64_t kNever = int64_t(1) << 60;
  Progress progress;
  fault.arm(kNever);
  operation.run(session, progress);
  const int64_t count = kNever - fault.left();
  fault.arm(0);
  return count;
}

/// Tries k = 1 and on, some `most` of them, until the operation needs fewer. Returns how many were
/// tried.
int64_t try_all(const Operation& operation, const Fault& fault, const Options& options,
                int64_t most) {
  Progress progress;
  Session first(room(), some_samples(), options);
  first.bake(progress);
  const MemoryArchive baked(first.save());
  const Digest before = first.digest();
  const int64_t all = count(operation, fault, first);
  const Digest after = first.digest();
  int64_t tried = 0;
  const int64_t stride = 1 + all / most;
  for (int64_t k = 1;; k += stride) {
    Session session(room(), some_samples(), options);
    MemoryArchive archive(baked);
    session.restore(archive, progress);
    light_of(session);  // what readings keep is there
    bool failed = false;
    fault.arm(k);
    try {
      operation.run(session, progress);
    } catch (const std::bad_alloc&) {
      failed = true;
    } catch (const Error&) {
      failed = true;
    }
    const bool came = fault.left() <= 0;
    fault.arm(0);
    if (!came) return tried;
    ++tried;
    const std::string where =
        std::string(operation.name) + ", " + fault.name + " " + std::to_string(k);
    if (!failed) {
      EXPECT_EQ(session.digest(), after) << where;
    }
    // A cancelled update has its edit, and the rest waits.
    session.update({}, 0, progress);
    const Digest now = session.digest();
    EXPECT_TRUE(now == before || now == after) << where;
    session.update(std::vector<scene::Edit>{scene::Move{1, at(1, 3)}}, 0, progress);
    const Digest updated = session.digest();
    const std::vector<double> light = light_of(session);
    session.recompute(progress);
    EXPECT_EQ(session.digest(), updated) << where;
    EXPECT_EQ(light_of(session), light) << where;
    if (testing::Test::HasFailure()) return tried;
  }
}

struct Setting {
  int threads;
  uint32_t rays;  // of each sample
  int64_t
      most;  // faults of a kind that are tried: cells of a gather are made of some 50,000 pieces
  const char* name;
};
class EachFault : public testing::TestWithParam<Setting> {};

TEST_P(EachFault, LeavesTheStateBeforeOrAfter) {
  const auto [threads, rays, most, name] = GetParam();
  for (const Fault& fault : faults())
    for (const Operation& operation : operations()) {
      const int64_t tried =
          try_all(operation, fault, small(threads, rays), all_of_them() ? 2000 : most);
      if (all_of_them()) {
        printf("%-16s %-24s %d threads, %u rays: %6lld\n", operation.name, fault.name, threads,
               rays, static_cast<long long>(tried));
        fflush(stdout);
      }
      ASSERT_FALSE(HasFailure());
    }
}

INSTANTIATE_TEST_SUITE_P(Faults, EachFault,
                         testing::Values(Setting{1, 8, 2, "some"}, Setting{1, 0, 2000, "all_Slow"},
                                         Setting{2, 0, 16, "two_threads_Slow"},
                                         Setting{1, 8, 16, "gather_Slow"},
                                         Setting{2, 8, 16, "gather_two_threads_Slow"}),
                         [](const auto& own) { return std::string(own.param.name); });

TEST(Faults, AFirstGradientThatFailsLeavesNoDiscsBehind) {
  scene::Scene scene = room();
  scene.objects.push_back(scene.objects[1]);
  scene.objects[2].name = "other block";
  scene.objects[2].pose.translation = {3, 0.5, 3};
  scene.finish();
  samples::SampleSet samples = some_samples();
  for (int i = 0; i < 4; ++i) {
    samples.point.push_back(samples.point[64 + size_t(i)]);
    samples.normal.push_back({0, 1, 0});
    samples.radius.push_back(0.2f);
    samples.attached.push_back(2);
  }
  Progress progress;
  Session whole(scene, samples, small(1, 8));
  whole.bake(progress);
  const std::vector<double> expected = gradient_of(whole, progress);
  int failures = 0;
  for (const fault::Kind kind : {fault::Kind::cancel, fault::Kind::commit})
    for (int64_t k = 1;; k += 1 + k / 4) {
      Session session(scene, samples, small(1, 8));
      session.bake(progress);
      const size_t bytes = session.bytes();
      const Digest before = session.digest();
      fault::arm(kind, k);
      bool failed = false;
      try {
        gradient_of(session, progress);
      } catch (const std::exception&) {
        failed = true;
      }
      fault::arm(kind, 0);
      if (!failed) break;
      ++failures;
      ASSERT_EQ(session.state().discs.moving.size(), 0u) << k;
      if (!session.areas().empty()) {
        EXPECT_GE(session.bytes(), bytes);
      }
      EXPECT_EQ(session.digest(), before);
      session.update(std::vector<scene::Edit>{scene::Move{2, at(2, 1)}}, 0, progress);
      session.update(std::vector<scene::Edit>{scene::Move{2, scene.objects[2].pose}}, 0, progress);
      EXPECT_EQ(session.digest(), before);
      EXPECT_EQ(gradient_of(session, progress), expected);
    }
  EXPECT_GT(failures, 5);
}

#ifdef DELTALUX_FAULTY_NEW
TEST(Faults, CellsOfAnObjectAreTakenBackWhole) {
  scene::Scene scene = room();
  Progress progress;
  gather::Cells cells(scene, trace::RayCaster(scene, progress), 1);
  const uint32_t size = cells.size();
  scene.objects.push_back(scene.objects[1]);
  scene.finish();
  bool came = true;
  for (int64_t k = 1; came; ++k) {
    bool failed = false;
    allocations_left = k;
    try {
      cells.add_object(scene, 2);
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    came = allocations_left <= 0;
    allocations_left = 0;
    if (!failed) {
      EXPECT_GT(cells.size(), size) << k;
    }
    cells.drop_objects(2);
    ASSERT_EQ(cells.size(), size) << k;
    ASSERT_EQ(cells.objects(), 2u) << k;
  }
}
#endif

}  // namespace
}  // namespace deltalux::session
