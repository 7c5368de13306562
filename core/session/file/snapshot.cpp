// SPDX-License-Identifier: Apache-2.0
// A source may be hostile: array sizes are checked before memory is allocated, and values before
// they are used.
#include "session/file/snapshot.h"

#include <cmath>
#include <numeric>

#include "base/error.h"
#include "session/flow/landings.h"
#include "session/paths/pilot_paths.h"
#include "session/update/check_edit.h"
#include "session/world/snapshot_check.h"

namespace deltalux::session {
namespace {

// bound of translations; the bounds of the moved objects are checked as well
constexpr double kFarthestMove = 4.0 * kFarthest;
static_assert(sizeof(trace::SunMap::Leaf) == 16);

void save_maps(std::span<const trace::Light> lights, ArchiveView& archive) {
  std::vector<uint32_t> leaves;
  archive.append("sun_maps", std::span<const trace::SunMap::Leaf>());
  for (const trace::Light& light : lights) {
    leaves.push_back(light.map ? uint32_t(light.map->leaves.size()) : 0);
    if (light.map) archive.append("sun_maps", light.map->leaves);
  }
  archive.keep("sun_map_leaves", leaves);
}

static_assert(sizeof(trace::AimMap::Target) == 16);

void save_aim_maps(std::span<const trace::Light> lights, ArchiveView& archive) {
  std::vector<uint32_t> targets;
  archive.append("aim_targets", std::span<const trace::AimMap::Target>());
  archive.append("aim_chances", std::span<const float>());
  for (const trace::Light& light : lights) {
    targets.push_back(light.aims ? uint32_t(light.aims->targets.size()) : 0);
    if (!light.aims) continue;
    archive.append("aim_targets", light.aims->targets);
    archive.append("aim_chances", light.aims->below);
  }
  archive.keep("aims", targets);
}

void restore_aim_maps(ArchiveSource& archive, std::span<trace::Light> lights) {
  const auto targets = archive.read_all<uint32_t>("aims", lights.size());
  size_t all = 0;
  for (size_t i = 0; i < lights.size(); ++i) {
    if (targets[i] && !(lights[i].area > 0))
      snapshot::refuse("\"aims\": found targets of a light without area");
    if (targets[i] > trace::AimMap::kMostTargets)
      snapshot::refuse("\"aims\": found more targets than any light has");
    all += targets[i];
  }
  archive.expect<trace::AimMap::Target>("aim_targets", all);
  archive.expect<float>("aim_chances", all * trace::AimMap::kParts);
  for (size_t i = 0; i < lights.size(); ++i) {
    lights[i].aims = nullptr;
    if (!targets[i]) continue;
    auto aims = std::make_shared<trace::AimMap>();
    aims->targets.resize(targets[i]);
    aims->below.resize(targets[i] * trace::AimMap::kParts);
    archive.read("aim_targets", std::span(aims->targets));
    archive.read("aim_chances", std::span(aims->below));
    if (const char* flaw = aims->flaw()) snapshot::refuse("\"aims\": found " + std::string(flaw));
    lights[i].aims = std::move(aims);
  }
}

void restore_maps(ArchiveSource& archive, std::span<trace::Light> lights) {
  const auto leaves = archive.read_all<uint32_t>("sun_map_leaves", lights.size());
  size_t all = 0;
  for (size_t i = 0; i < lights.size(); ++i) {
    if (leaves[i] && !lights[i].is_parallel())
      snapshot::refuse("\"sun_map_leaves\": found leaves of a light that is no sun");
    all += leaves[i];
  }
  archive.expect<trace::SunMap::Leaf>("sun_maps", all);
  for (size_t i = 0; i < lights.size(); ++i) {
    lights[i].map = nullptr;
    if (!leaves[i]) continue;
    auto map = std::make_shared<trace::SunMap>();
    map->leaves.resize(leaves[i]);
    archive.read("sun_maps", std::span(map->leaves));
    if (const char* flaw = map->flaw())
      snapshot::refuse("\"sun_maps\": found " + std::string(flaw));
    lights[i].map = std::move(map);
  }
}

/// Whether the archive has paths, as it must for a session of all of them: a session that shares
/// them may trace its own again.
bool brings_paths(const State& s, ArchiveSource& archive) {
  return s.holds_all() || archive.bytes("cut").has_value();
}

/// The scene as edits left it.
void save_scene(const State& s, ArchiveView& archive) {
  std::vector<double> poses;
  std::vector<uint8_t> present;
  for (const scene::Object& object : s.scene.objects) {
    for (const Vec3d& row : object.pose.row) poses.insert(poses.end(), {row.x, row.y, row.z});
    const Vec3d t = object.pose.translation;
    poses.insert(poses.end(), {t.x, t.y, t.z});
    present.push_back(object.present);
  }
  std::vector<Vec3f> reflectance;
  for (const scene::Material& m : s.scene.materials) reflectance.push_back(m.reflectance);
  const Box& world = s.scene.first_world();
  archive.keep("world", std::vector<Vec3f>{world.low, world.high});
  archive.keep("poses", poses);
  archive.keep("present", present);
  archive.keep("reflectance", reflectance);
  archive.keep("loaded_objects", std::vector<uint32_t>{s.loaded_objects});
  archive.append("group_factor", s.group_factor);
  archive.append("radius", s.samples.radius);
}

/// What the bake chose.
void save_bake(const State& s, ArchiveView& archive) {
  s.discs.save_choices(archive);
  std::vector<uint64_t> light_paths;
  std::vector<int32_t> finer;
  for (const trace::Light& light : s.lights) {
    light_paths.push_back(light.path_count);
    finer.push_back(light.finer);
  }
  archive.append("path_shares", s.path_shares);
  archive.keep("light_paths", light_paths);
  archive.keep("light_finer", finer);
  save_maps(s.lights, archive);
  save_aim_maps(s.lights, archive);
  archive.append("light_sampled", s.light_sampled);
  archive.keep("quantum", std::vector<double>{s.scale.quantum, double(s.scale.digits)});
  archive.keep("level_sizes", s.paths.level_sizes());
  s.direct.save_choices(archive);
}

void restore_scene(State& s, ArchiveSource& archive) {
  const size_t objects = s.scene.objects.size();
  const auto poses = archive.read_all<double>("poses", 12 * objects);
  snapshot::check_range("poses", poses, -kFarthestMove, kFarthestMove);
  const auto present = archive.read_all<uint8_t>("present", objects);
  snapshot::check_range("present", present, 0, 1);
  const std::vector<scene::Object> original = s.scene.objects;
  for (size_t i = 0; i < objects; ++i) {
    const double* p = poses.data() + 12 * i;
    Pose& pose = s.scene.objects[i].pose;
    for (int r = 0; r < 3; ++r) pose.row[r] = {p[3 * r], p[3 * r + 1], p[3 * r + 2]};
    pose.translation = {p[9], p[10], p[11]};
    s.scene.objects[i].present = present[i] != 0;
  }
  // finish() computed a box that also holds meshes added by edits, so it is never smaller than the
  // saved one.
  const auto world = archive.read_all<Vec3f>("world", 2);
  if (!s.scene.first_world().contains({world[0], world[1]}))
    snapshot::refuse("\"world\" is larger than the scene");
  s.scene.set_world({world[0], world[1]});
  snapshot::check_poses(original, s.scene);
  s.hold_objects();
  const auto reflectance = archive.read_all<float>("reflectance", 3 * s.scene.materials.size());
  snapshot::check_range("reflectance", reflectance, 0, 1);
  for (size_t m = 0; m < s.scene.materials.size(); ++m) {
    const Vec3f own{reflectance[3 * m], reflectance[3 * m + 1], reflectance[3 * m + 2]};
    check(s, scene::SetReflectance{uint32_t(m), own}, {});
    s.scene.materials[m].reflectance = own;
  }
  const uint32_t loaded = archive.read_all<uint32_t>("loaded_objects", 1)[0];
  if (loaded > objects || std::any_of(original.begin() + long(loaded), original.end(),
                                      [](const scene::Object& own) { return !own.movable; }))
    snapshot::refuse("\"loaded_objects\": found a number that no session has");
  s.count_as_loaded(loaded);
  s.group_factor = archive.read_all<double>("group_factor", s.scene.group_count);
  for (uint32_t group = 0; group < s.scene.group_count; ++group)
    check(s, scene::Dim{group, s.group_factor[group]}, {});
  auto radius = archive.read_all<float>("radius", s.samples.size());
  snapshot::check_radii(radius, s.samples.radius, s.scene.first_world(),
                        archive.bytes("level_sizes") && !s.options.gather_rays);
  for (size_t i = 0; i < radius.size(); ++i)
    if (!std::isnan(radius[i]))
      s.samples.radius[i] = radius[i];  // leave our own quiet NaN in place of the file's
  for (trace::Light& light : s.lights) trace::place_light(s.scene, light);
}

/// Restores the path counts of lights and the scales.
void restore_lights(State& s, ArchiveSource& archive) {
  const auto light_paths = archive.read_all<uint64_t>("light_paths", s.lights.size());
  snapshot::check_range("light_paths", light_paths, 1, double(UINT32_MAX));
  uint64_t paths = 0;
  for (size_t i = 0; i < s.lights.size(); ++i) {
    s.lights[i].first_path = paths;
    s.lights[i].path_count = light_paths[i];
    paths += light_paths[i];
  }
  s.path_shares = archive.read_all<double>("path_shares", s.loaded_lights.size());
  for (const double share : s.path_shares)
    if (!(share >= 0) || !std::isfinite(share))
      snapshot::refuse("\"path_shares\": found a share that is negative or not finite");
  restore_maps(archive, s.lights);
  restore_aim_maps(archive, s.lights);
  const auto quantum = archive.read_all<double>("quantum", 2);
  snapshot::check_quantum("quantum", quantum[0],
                          trace::choose_scale(s.lights, s.options.max_bounces).quantum);
  snapshot::check_range("quantum", std::vector<double>{quantum[1]}, 1,
                        trace::EnergyScale::kMostDigits);
  s.scale = {quantum[0], int(quantum[1])};
  if (paths > s.scale.most_paths(s.options.max_bounces))
    snapshot::refuse("\"light_paths\": found " + std::to_string(paths) + " paths, more than fit");
  s.paths.held = s.held();
  if (brings_paths(s, archive)) archive.expect<uint16_t>("cut", s.paths.held.size());
  s.light_sampled = archive.read_all<uint8_t>("light_sampled", s.lights.size());
  snapshot::check_range("light_sampled", s.light_sampled, 0, 1);
  const auto finer = archive.read_all<int32_t>("light_finer", s.lights.size());
  snapshot::check_range("light_finer", finer, trace::kLeastFineness, trace::kMostFineness);
  for (size_t i = 0; i < s.lights.size(); ++i) s.lights[i].finer = finer[i];
  s.share_sums();
  for (const trace::Light& light : s.lights)
    // throws if the quantum is too fine
    trace::birth_quanta(light, s.scale, s.birth_factor(light));
}

/// Restores guides, the light of the cells, and what gather rays met.
void restore_rays(State& s, ArchiveSource& archive, Progress& progress) {
  if (!s.gathers()) return;
  s.rays.restore_choices(archive);
  const Landings landings(s);
  std::vector<uint32_t> slots;
  for (uint32_t b = 0; b < s.paths.store.bounces().size(); ++b) {
    slots.resize(s.paths.store.bounces()[b].size());
    std::iota(slots.begin(), slots.end(), 0u);
    landings.add(b, slots, +1);
  }
  if (!s.evaluates()) return;
  s.cells.cover(progress);
  s.rays.restore(archive, progress);
}

}  // namespace

ArchiveView save(const State& s, bool shared) {
  check_whole(s);
  check_gathered(s);
  ArchiveView archive;
  save_scene(s, archive);
  if (!s.baked) return archive;
  save_bake(s, archive);
  s.paths.save(archive);
  s.discs.save(archive, !shared);
  if (s.options.range && !shared) archive.keep("edits", std::vector<uint64_t>{s.edits});
  s.direct.save(archive);
  s.rays.save(archive);
  return archive;
}

ArchiveView save_choices(const State& s) {
  check_whole(s);
  ArchiveView archive;
  save_scene(s, archive);
  if (!s.baked) return archive;
  save_bake(s, archive);
  archive.keep("edits", std::vector<uint64_t>{s.edits});
  if (s.gathers()) s.rays.guiding.save_samples(0, 0, archive);
  return archive;
}

void restore(State& s, ArchiveSource& archive, Progress& progress) {
  restore_scene(s, archive);
  if (!archive.bytes("level_sizes")) return;
  restore_lights(s, archive);
  const bool traced = brings_paths(s, archive), discs = s.counts_in_discs();
  if (traced && discs) archive.expect<int64_t>("sums", s.discs.sum_count());
  if (discs) archive.expect<float>("area", s.samples.size());
  s.index_triangles(progress);
  PlacedDiscs placed;
  if (discs) {
    s.resolve_radii(progress);
    placed = s.discs.restore_choices(archive, progress);
  }
  s.discs.plan(placed, discs ? walk_pilot_paths(s, progress) : PilotPaths{}, false, progress);
  s.discs.make_estimators(placed, progress);
  s.cells.divide(progress);
  if (traced) {
    s.paths.restore(archive, s.cells.division.size(), s.discs.still->discs().size(), progress);
    s.discs.restore(archive, s.paths.store.live());
  } else {
    archive.read_all<uint64_t>("level_sizes", archive.count<uint64_t>("level_sizes"));
    s.discs.clear_sums();
    s.paths.wait();
  }
  if (s.options.range && archive.bytes("edits"))
    s.edits = archive.read_all<uint64_t>("edits", 1)[0];
  s.direct.restore(archive);
  restore_rays(s, archive, progress);
  s.baked = true;
}

}  // namespace deltalux::session
