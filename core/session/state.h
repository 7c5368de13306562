// SPDX-License-Identifier: Apache-2.0
// Everything a session holds, as plain data; only the functions of this folder change it.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "base/parallel.h"
#include "gather/evaluate.h"
#include "plan/planner.h"
#include "samples/disc_area.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "segments/segment_store.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/walk.h"

namespace deltalux::session {

inline constexpr uint32_t kBatches = 8;       // independent estimates behind the standard error
inline constexpr uint32_t kMaxSumGroups = 8;  // later groups share the last one's sums
inline constexpr uint8_t kNotCut = 255;
inline constexpr double kExpectedFrames = 100;    // of a session with movables
inline constexpr uint64_t kPathsPerStep = 32768;  // of a bake; each gives every batch its share
// Paths replaced between two looks at clock and cancel flag.
inline constexpr size_t kMaxPerStep = 8192;

using plan::Method;

enum class DirectMode : uint8_t { automatic, paths, sampled };

struct Options {
  uint64_t paths = 1'000'000;
  uint64_t seed = 1;
  int threads = 0;
  segments::SegmentEnd segment_end = segments::SegmentEnd::first;
  samples::DiscArea disc_area = samples::DiscArea::reachable;
  DirectMode direct = DirectMode::automatic;
  Method static_method = Method::automatic, moving_method = Method::automatic;
  plan::Policy policy = plan::Policy::measured;
  plan::Machine machine = plan::typical_machine();
  double expected_frames = kExpectedFrames;  ///< of the choice of methods
  bool rebuilds = false;  ///< the plan is for estimators made anew in every frame
  uint32_t max_bounces = 64;
  size_t memory_limit = 0;   ///< bytes, 0 = none
  uint32_t gather_rays = 0;  ///< of each sample; 0: all light by discs
};

/// Samples that move with one object: discs and index in the object's own space.
struct MovingPart {
  uint32_t object = scene::kNone;
  std::unique_ptr<estimate::SignedEstimator> index;
  Box local;             ///< of all discs
  Box world;             ///< of `local` in the present pose, conservative
  bool current = false;  ///< sums are those of the present pose
};

/// What a display shows of gathered light; nothing else depends on it.
struct Glance {
  std::vector<std::array<double, 3>> irradiance;  ///< per sample
  bool stale = true;                              ///< all have to be read
  size_t turn = 0;
  size_t bytes() const { return irradiance.capacity() * sizeof(std::array<double, 3>); }
};

/// What a session that gathers holds besides: see gather/.
struct Gather {
  gather::Cells cells;
  gather::CellSums sums;
  gather::CellLight light;  ///< as of the last reading
  gather::Coverage coverage;
  gather::Looks looks;
  gather::Beams beams;
  gather::Suns suns{};
  Glance glance{};
};

struct State {
  explicit State(const Options& o) : options(o), workers(o.threads) {}

  Options options;
  Workers workers;
  scene::Scene scene;
  /// Along a space-filling curve: what lies close together in space does so in the sums, which
  /// takes a quarter off a deposit where discs overlap much.
  samples::SampleSet samples;
  std::vector<uint32_t> given;     // per sample of `samples`, its number among the user's
  std::vector<Box> sample_bounds;  // per object, local: of the samples that move with it

  std::unique_ptr<trace::RayCaster> caster;
  std::vector<trace::Light> lights;       // ascending first_path
  std::vector<uint8_t> light_sampled;     // 1 = direct part by shadow rays, not by first flights
  std::vector<double> group_factor;       // dim factors, per group
  std::vector<Vec3f> loaded_reflectance;  // per material, before any edit
  trace::EnergyScale scale;
  double irradiance_quantum = 0;  // of direct light by shadow rays; fixed at the bake
  float largest_radius = 0;

  std::unique_ptr<estimate::SignedEstimator> static_index;
  std::vector<MovingPart> moving;
  std::vector<plan::PartPlan> plans;  // of the static part, then of each moving one
  std::vector<float> area;            // per sample: what its disc counts, now

  segments::SegmentStore store;
  std::vector<uint8_t> cut;        // per path: pending re-trace from this bounce, or kNotCut
  std::vector<int64_t> sums;       // EnergySums, slab = group * kBatches + batch
  std::unique_ptr<Gather> gather;  // of sessions that gather
  gather::Guiding guiding;         // of those; its guides are fixed at the bake

  /// What `object` with its lights and samples takes up at `pose`.
  Box bounds_at(uint32_t object, const Pose& pose) const {
    Box box = scene.bounds_at(object, pose);
    if (object < sample_bounds.size()) box.grow(pose.box(sample_bounds[object]));
    return box;
  }
  segments::Extras extras() const {
    return {options.segment_end != segments::SegmentEnd::first, options.gather_rays > 0};
  }
  uint32_t sum_groups() const { return std::min(scene.group_count, kMaxSumGroups); }
  bool merged(uint32_t group) const {
    return scene.group_count > kMaxSumGroups && group + 1 >= kMaxSumGroups;
  }
  /// What a group's sums are to be multiplied by.
  double sum_factor(uint32_t group) const { return merged(group) ? 1.0 : group_factor[group]; }
  uint32_t sum_group(uint32_t group) const { return std::min(group, kMaxSumGroups - 1); }
  estimate::EnergySums energy() { return {sums.data(), samples.size()}; }
  size_t light_of(uint32_t path) const {
    size_t low = 0, high = lights.size();
    while (high - low > 1) {
      const size_t middle = (low + high) / 2;
      (lights[middle].first_path <= path ? low : high) = middle;
    }
    return low;
  }
  /// Dim factor that is part of a path's power at birth: only groups without sums of their own.
  double birth_factor(const trace::Light& light) const {
    return merged(light.group) ? group_factor[light.group] : 1.0;
  }
  trace::Walk walk() const {
    return {scene,
            *caster,
            {options.seed, kBatches, options.max_bounces,
             options.segment_end != segments::SegmentEnd::first,
             options.segment_end == segments::SegmentEnd::bounded
                 ? segments::kBoundedRadii * largest_radius
                 : std::numeric_limits<float>::infinity()}};
  }
};

}  // namespace deltalux::session
