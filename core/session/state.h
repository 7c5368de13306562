// SPDX-License-Identifier: Apache-2.0
// All data of a session, in plain structs; only the functions of this folder change them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/assertion.h"
#include "base/parallel.h"
#include "direct/scales.h"
#include "gather/evaluate.h"
#include "plan/planner.h"
#include "samples/disc_area.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "segments/segment_store.h"
#include "session/held_paths.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/walk.h"

namespace deltalux::session {

// independent estimates, whose spread gives the standard error
inline constexpr uint32_t kBatches = 8;
inline constexpr uint32_t kMaxOwnGroups = 8;  // later light groups share the last one's sums
// State::cut of a path that is not to be traced again.
inline constexpr uint16_t kNotCut = 0xffff;
// number of updates expected of a session with movables
inline constexpr double kExpectedFrames = 100;
// Paths traced per step of a bake; every batch contributes its share to each step.
inline constexpr uint64_t kPathsPerStep = 32768;
// Paths replaced between two checks of the clock and of the cancel flag.
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
  /// Number of updates that the choice of methods assumes.
  double expected_frames = kExpectedFrames;
  /// Plan as if estimators were built anew in every frame.
  bool rebuilds = false;
  uint32_t max_bounces = 1000;
  size_t memory_limit = 0;  ///< bytes, 0 = none
  /// Gather rays per sample; 0: no final gather, discs count all light.
  uint32_t gather_rays = 0;
  /// The paths that the session traces and stores; nullopt: all. Whatever a bake chooses from data
  /// (path counts of lights, quanta, radii, which lights get shadow rays) is that of all paths.
  std::optional<PathRange> range;
};

/// The samples attached to one object, with discs and index in the object's local space.
struct MovingPart {
  uint32_t object = scene::kNone;
  /// Counts segments in local space; holds the discs.
  std::unique_ptr<estimate::SignedEstimator> index;
  Box local;             ///< bounds of all discs in local space
  Box world;             ///< bounds of `local` in the present pose, conservative
  bool current = false;  ///< whether the sums are those of the present pose
};

/// The gathered light that a display shows during a drag; nothing else depends on it.
struct Glance {
  std::vector<std::array<double, 3>> irradiance;  ///< per sample
  bool stale = true;                              ///< all samples have to be read
  size_t turn = 0;
  size_t bytes() const { return irradiance.capacity() * sizeof(std::array<double, 3>); }
};

/// What sessions with a final gather hold in addition, see gather/.
struct Gather {
  gather::Cells cells;
  gather::CellSums sums;
  gather::CellLight light;  ///< as of the last read
  gather::Coverage coverage;
  gather::Looks looks;
  gather::Beams beams;
  gather::Suns suns{};
  Glance glance{};
};

/// What sums keep apart: lights of one group whose power has one quantum.
struct SumGroup {
  uint32_t group = 0;  ///< of lights; kMaxOwnGroups - 1 stands for all from there on
  int finer = 0;       ///< trace::Light::finer
  friend bool operator==(const SumGroup&, const SumGroup&) = default;
};

/// Sets Light::sums of these lights, and appends the groups that are missing.
void assign_sums(std::span<trace::Light> lights, std::vector<SumGroup>& groups);

struct State {
  explicit State(const Options& o) : options(o), workers(o.threads) {}

  Options options;
  Workers workers;
  scene::Scene scene;
  /// In the order of a space-filling curve, so that samples that are close in space are close in
  /// memory. That saves a quarter of the time of a deposit where discs overlap much.
  samples::SampleSet samples;
  std::vector<uint32_t> given;     // for each sample of `samples`: its index as given by the user
  std::vector<Box> sample_bounds;  // by object: local bounds of the samples attached to it

  std::unique_ptr<trace::RayCaster> caster;
  std::vector<trace::Light> lights;       // in ascending order of first_path
  std::vector<uint8_t> light_sampled;     // 1: direct light by shadow rays, not by first flights
  std::vector<double> group_factor;       // dim factors, per group
  std::vector<Vec3f> loaded_reflectance;  // by material, before any edit
  trace::EnergyScale scale;
  std::vector<SumGroup> sum_groups{1};          // of the lights, in the order of these
  std::optional<direct::Scales> direct_scales;  // fixed at the bake
  float largest_radius = 0;

  std::unique_ptr<estimate::SignedEstimator> static_index;
  std::vector<MovingPart> moving;
  /// For the static part, then for each movable that samples are attached to.
  std::vector<plan::PartPlan> plans;
  std::vector<float> area;   // by sample: the area that its disc counts at present
  std::vector<float> slack;  // by sample: Scene::slack_of() of the surface under it; of the bake
  // By sample, see samples/openness.h; 1 where it does not count, or is not known yet.
  std::vector<float> openness;
  bool openness_complete = false;  // in a session without paths: whether all parts told theirs

  HeldPaths held;
  segments::SegmentStore store;
  // By slot of bounce 0: the bounce from which its path waits to be traced again, or kNotCut.
  std::vector<uint16_t> cut;
  std::vector<int64_t> sums;  // EnergySums, slab = group * kBatches + batch
  // Its marks: what changed since Session::path_changes() was called last; empty before it was.
  std::vector<uint8_t> sum_marks;
  uint64_t edits = 0;  // number of edits in effect since the bake
  // In a session without paths: the ranges of other sessions whose sums, of the present state, are
  // in these sums; and the edits in effect when those of all paths were, nullopt: never yet.
  std::vector<PathRange> added;
  std::optional<uint64_t> added_since;
  std::unique_ptr<Gather> gather;  // null without a final gather
  gather::Guiding guiding;         // for the final gather; its guides are fixed at the bake

  /// Bounds of `object` at `pose`, including its lights and samples.
  Box bounds_at(uint32_t object, const Pose& pose) const {
    Box box = scene.bounds_at(object, pose);
    // Turned, the bounds of the samples may reach farther than all of them.
    if (object >= sample_bounds.size() || box.contains(pose.box(sample_bounds[object]))) return box;
    for (size_t i = 0; i < samples.size(); ++i)
      if (samples.attached[i] == object) box.grow(pose.point(samples.point[i]));
    return box;
  }
  /// Makes Scene::world() hold all present movables.
  void hold_objects() {
    Box reached;
    for (uint32_t i = 0; i < scene.objects.size(); ++i)
      if (const scene::Object& own = scene.objects[i]; own.movable && own.present)
        reached.grow(bounds_at(i, own.pose));
    scene.hold(reached);
  }
  segments::Extras extras() const {
    return {options.segment_end != segments::SegmentEnd::first, options.gather_rays > 0};
  }
  /// Number of paths of all lights, whoever holds them.
  uint64_t all_paths() const {
    return lights.empty() ? 0 : lights.back().first_path + lights.back().path_count;
  }
  bool holds_all() const { return !options.range; }
  bool holds_none() const { return options.range && options.range->first == options.range->last; }
  /// Whether there are direct light by shadow rays, gather rays and results. A session with a range
  /// of the paths has only what paths bring, since the rest would be the same in every range.
  bool evaluates() const { return holds_all() || holds_none(); }
  /// Whether discs have light to count. In a session with a final gather all of whose lights get
  /// shadow rays, they have none, so that they are not made.
  bool counts_in_discs() const {
    return !options.gather_rays || options.direct == DirectMode::paths ||
           std::find(light_sampled.begin(), light_sampled.end(), 0) != light_sampled.end();
  }
  /// Whether lights that an edit adds get shadow rays.
  bool samples_added_lights() const {
    return options.direct == DirectMode::sampled || !counts_in_discs();
  }
  uint32_t slabs() const { return uint32_t(sum_groups.size()) * kBatches; }
  size_t sum_count() const { return counts_in_discs() ? size_t(slabs()) * samples.size() * 3 : 0; }
  size_t mark_count() const {
    return slabs() * estimate::EnergySums::marks_of_slab(samples.size());
  }
  bool counts_openness() const {
    return options.disc_area == samples::DiscArea::reachable && !options.gather_rays;
  }
  /// Whether `openness` has what this session computes, or is told.
  bool knows_openness() const { return openness_complete || !counts_openness() || !holds_none(); }
  /// The first sample whose openness this session computes, and the one after the last. Sessions
  /// that share the paths share the samples for that alike.
  std::pair<size_t, size_t> own_samples() const {
    if (holds_all()) return {0, samples.size()};
    const auto share = [&](uint64_t path) { return size_t(samples.size() * path / options.paths); };
    return {share(options.range->first), share(options.range->last)};
  }
  /// The paths of a range, of the present lights.
  HeldPaths held_of(const PathRange& range) const {
    HeldPaths paths(range, options.paths, kBatches);
    for (const trace::Light& light : lights) paths.add(light);
    return paths;
  }
  /// Recomputes `held` for the present lights.
  void hold_paths() { held = held_of(options.range.value_or(PathRange{0, options.paths})); }
  /// Whether the light group has no sums of its own: with more than eight groups, those from the
  /// eighth on share them.
  bool merged(uint32_t group) const { return merged(group, scene.group_count); }
  static bool merged(uint32_t group, size_t group_count) {
    return group_count > kMaxOwnGroups && group + 1 >= kMaxOwnGroups;
  }
  /// Present power per quantum of the sums of `sum_groups[index]`, with the present dimming.
  double sum_unit(size_t index) const {
    const SumGroup& own = sum_groups[index];
    return scale.of(own.finer) * (merged(own.group) ? 1.0 : group_factor[own.group]);
  }
  /// sum_unit() of all `sum_groups`.
  std::vector<double> sum_units() const {
    std::vector<double> out;
    for (size_t g = 0; g < sum_groups.size(); ++g) out.push_back(sum_unit(g));
    return out;
  }
  /// Chooses, for the present scale, the quantum of each light and the sums that its paths add to.
  void group_sums() {
    for (trace::Light& light : lights) light.finer = trace::choose_fineness(light, scale);
    share_sums();
  }
  /// The same for lights whose quanta are known.
  void share_sums() {
    sum_groups.clear();
    assign_sums(lights, sum_groups);
    if (sum_groups.empty()) sum_groups.emplace_back();
  }
  estimate::EnergySums energy() {
    estimate::EnergySums out{sums.data(), samples.size()};
    DELTALUX_ASSERT(sum_marks.empty() || sum_marks.size() == mark_count());
    if (!sum_marks.empty()) out.marks = sum_marks.data();
    return out;
  }
  /// By light: 1 if gather rays get its direct light by shadow rays, so that cells leave it out.
  std::vector<uint8_t> asked_for() const { return asked_for(guiding); }
  std::vector<uint8_t> asked_for(const gather::Guiding& by) const {
    std::vector<uint8_t> asked(lights.size());
    for (const gather::BeamGuide& beam : by.beams) asked[beam.light] = 1;
    for (const uint32_t sun : by.suns) asked[sun] = 1;
    return asked;
  }
  size_t light_of(uint32_t path) const {
    size_t low = 0, high = lights.size();
    while (high - low > 1) {
      const size_t middle = (low + high) / 2;
      (lights[middle].first_path <= path ? low : high) = middle;
    }
    DELTALUX_ASSERT(low < high && path - lights[low].first_path < lights[low].path_count);
    return low;
  }
  /// The dim factor included in a path's power when it leaves the light: other than 1 only for
  /// groups without sums of their own.
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
