// SPDX-License-Identifier: Apache-2.0
// The world that all layers of a session read: scene, samples, lights, and the quanta of light.
#pragma once
#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "base/assertion.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "session/world/held_paths.h"
#include "session/world/options.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/walk.h"

namespace deltalux::session {

/// What sums keep apart: lights of one group whose power has one quantum.
struct SumGroup {
  uint32_t group = 0;  ///< of lights; kMaxOwnGroups - 1 stands for all from there on
  int finer = 0;       ///< trace::Light::finer
  friend bool operator==(const SumGroup&, const SumGroup&) = default;
};

/// Sets Light::sums of these lights, and appends the groups that are missing.
void assign_sums(std::span<trace::Light> lights, std::vector<SumGroup>& groups);

/// What the user gave, what edits made of it, and what a bake chose before any layer.
struct World {
  explicit World(const Options& o) : options(o), workers(o.threads) {}
  /// Throws SceneError, OptionError.
  World(scene::Scene scene, samples::SampleSet samples, const Options& options);
  /// Copies what the user gave and edits made of it, without what a bake chose.
  void take_given(const World& other);

  Options options;
  Workers workers;
  scene::Scene scene;
  /// In the order of a space-filling curve, so that samples that are close in space are close in
  /// memory. That saves a quarter of the time of a deposit where discs overlap much.
  samples::SampleSet samples;
  std::vector<uint32_t> given;     // for each sample of `samples`: its index as given by the user
  std::vector<Box> sample_bounds;  // by object: local bounds of the samples attached to it

  std::unique_ptr<trace::RayCaster> caster;
  std::vector<trace::Light> lights;    // in ascending order of first_path
  std::vector<uint8_t> light_sampled;  // 1: direct light by shadow rays, not by first flights
  std::vector<double> group_factor;    // dim factors, per group
  // Before any edit, since choices must not depend on edits: reflectances by material, objects and
  // lights.
  std::vector<Vec3f> loaded_reflectance;
  uint32_t loaded_objects = 0;
  std::vector<trace::Light> loaded_lights;
  std::vector<double> path_shares;  // of loaded_lights, relative to each other; of the bake
  trace::EnergyScale scale;
  std::vector<SumGroup> sum_groups{1};  // of the lights, in the order of these
  std::vector<float> slack;  // by sample: Scene::slack_of() of the surface under it; of the bake
  float largest_radius = 0;

  /// Builds the ray caster, and finds what samples lie on. Throws Cancelled.
  void index_triangles(Progress& progress);
  /// Chooses radii of samples where the user gave none.
  void resolve_radii(Progress& progress);
  /// Divides the paths among the loaded lights, by the use of their light, and chooses the quanta
  /// of power and the lights whose direct light comes from shadow rays. Then adds the other lights.
  void allot_paths(Progress& progress);
  /// Appends the lights of objects from `first` on, which edits added. If these are the first
  /// lights of all, chooses the quanta of power by those of the first object that has some, and
  /// returns their number; otherwise 0.
  size_t add_lights(uint32_t first);
  /// Whether lamps and reflectances are as they were loaded, so that a new session of the scene as
  /// it is would choose as a bake here does.
  bool is_as_loaded() const;
  /// Says that edits added the objects from this one on.
  void count_as_loaded(uint32_t objects);
  /// The scene before any edit, but without movables: nothing in it depends on edits.
  scene::Scene as_loaded() const;
  /// A loaded light before any edit, with the paths that the present one has.
  trace::Light as_loaded(size_t light) const;
  bool is_present(size_t sample) const {
    const uint32_t object = samples.attached[sample];
    return object == scene::kNone || scene.objects[object].present;
  }
  /// Brings values from the order of `samples` into the order in which the user gave them.
  std::vector<float> as_given(const std::vector<float>& own) const;
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
  /// Whether a final gather brings the light of reflections, instead of discs.
  bool gathers() const { return options.gather_rays > 0; }
  /// Whether discs count caustics, which gather rays do not find, see segments::LightHistory. Where
  /// there is no gather, discs count them with all other light.
  bool has_caustics() const { return gathers() && scene.has_specular(); }
  segments::Extras extras() const {
    return {options.segment_end != segments::SegmentEnd::first, gathers(),
            has_caustics() || scene.transmits()};
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
    return !options.gather_rays || options.direct == DirectMode::paths || has_caustics() ||
           std::find(light_sampled.begin(), light_sampled.end(), 0) != light_sampled.end();
  }
  /// Whether lights that an edit adds get shadow rays.
  bool samples_added_lights() const {
    return options.direct == DirectMode::sampled || !counts_in_discs();
  }
  uint32_t slabs() const { return uint32_t(sum_groups.size()) * kBatches; }
  bool counts_openness() const {
    return options.disc_area == samples::DiscArea::reachable && !options.gather_rays;
  }
  /// The first sample whose openness this session computes, and the one after the last. Sessions
  /// that share the paths share the samples for that alike.
  std::pair<size_t, size_t> own_samples() const {
    if (holds_all()) return {0, samples.size()};
    const auto share = [&](uint64_t path) { return size_t(samples.size() * path / options.paths); };
    return {share(options.range->first), share(options.range->last)};
  }
  /// The paths that this session holds, of the present lights.
  HeldPaths held() const { return held_of(options.range.value_or(PathRange{0, options.paths})); }
  /// The paths of a range, of the present lights.
  HeldPaths held_of(const PathRange& range) const {
    HeldPaths paths(range, options.paths, kBatches);
    for (const trace::Light& light : lights) paths.add(light);
    return paths;
  }
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
  /// Number of groups of the cells' sums, and the group of a light's paths there. Where there are
  /// caustics, each of `sum_groups` has another one beside it, of them alone.
  uint32_t cell_groups() const { return uint32_t(sum_groups.size()) * (has_caustics() ? 2 : 1); }
  uint32_t cell_group(uint32_t sums, bool caustic) const {
    return has_caustics() ? 2 * sums + caustic : sums;
  }
  /// Power per quantum of each of these groups for all light, or for caustics alone.
  std::vector<double> cell_units(bool caustic = false) const {
    std::vector<double> out(cell_groups());
    for (uint32_t g = 0; g < sum_groups.size(); ++g) out[cell_group(g, caustic)] = sum_unit(g);
    return out;
  }
  /// Calls visit(number of the light, path number within it) for every k-th path of each light,
  /// about 8192 in all, whoever holds them.
  template <class Visit>
  void each_pilot_path(const Visit& visit) const {
    constexpr uint64_t kPilotPaths = 8192;
    const uint64_t stride = std::max<uint64_t>(1, all_paths() / kPilotPaths);
    for (uint32_t l = 0; l < lights.size(); ++l)
      for (uint64_t i = stride / 2; i < lights[l].path_count; i += stride) visit(l, i);
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

/// The lights of `object` of `scene`, with path counts that suit the lights already in `world`:
/// their paths carry as much power as those of the brightest existing light divided by two, so that
/// noise stays even, but a light gets at least the share of paths that each of `groups` groups is
/// granted, since other lights may be dimmed. Throws SceneError.
std::vector<trace::Light> added_lights(const World& world, const scene::Scene& scene,
                                       uint32_t object, uint32_t groups);

}  // namespace deltalux::session
