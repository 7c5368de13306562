// SPDX-License-Identifier: Apache-2.0
// Saves a session's state as named arrays and restores it. The caller keeps scene, samples and
// options, and makes a fresh session from them; restore() adds what baking and editing made of it.
// A source may be hostile: array sizes are checked before memory is allocated, and values before
// they are used.
#include <cmath>

#include "base/error.h"
#include "samples/openness.h"
#include "session/pilot_paths.h"
#include "session/session.h"
#include "session/session_parts.h"
#include "session/snapshot_check.h"

namespace deltalux::session {
namespace {

// bound of translations; the bounds of the moved objects are checked as well
constexpr double kFarthestMove = 4.0 * kFarthest;
constexpr uint32_t kPerChunk = segments::BounceSegments::kChunk;

std::string level_name(size_t bounce, const char* what) {
  return "level" + std::to_string(bounce) + "." + what;
}

void append_bounce(const State& s, size_t bounce, ArchiveView& archive) {
  const segments::BounceSegments& stored = s.store.bounces()[bounce];
  const segments::Extras& extras = s.store.extras();
  const std::string segments = level_name(bounce, "segments"), hits = level_name(bounce, "hits"),
                    extended = level_name(bounce, "extended"),
                    landing = level_name(bounce, "landing");
  archive.append(segments, std::span<const segments::Segment>());
  archive.append(hits, std::span<const segments::HitSlots>());
  archive.append(extended, std::span<const float>());
  if (extras.landing) archive.append(landing, std::span<const uint32_t>());
  for (uint32_t slot = 0; slot < stored.size(); slot += kPerChunk) {
    const segments::BounceSegments::Chunk& chunk = stored.chunk(slot);
    const size_t count = std::min(kPerChunk, stored.size() - slot);
    archive.append(segments, std::span(chunk.segment).first(count));
    if (s.counts_in_discs()) archive.append(hits, std::span(chunk.slots).first(count));
    if (extras.extended)
      archive.append(extended, std::span<const float>(chunk.extended.get(), count));
    if (extras.landing)
      archive.append(landing, std::span<const uint32_t>(chunk.landing.get(), count));
  }
}

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
    if (targets[i] && !lights[i].is_area())
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

}  // namespace

void Session::save_scene(ArchiveView& archive) const {
  const State& s = *state_;
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
  archive.append("group_factor", s.group_factor);
  archive.append("radius", s.samples.radius);
}

void Session::save_bake(ArchiveView& archive) const {
  const State& s = *state_;
  if (s.counts_in_discs() && s.knows_openness()) archive.append("openness", s.openness);
  std::vector<uint64_t> light_paths, level_sizes;
  std::vector<int32_t> finer;
  for (const trace::Light& light : s.lights) {
    light_paths.push_back(light.path_count);
    finer.push_back(light.finer);
  }
  archive.keep("light_paths", light_paths);
  archive.keep("light_finer", finer);
  save_maps(s.lights, archive);
  save_aim_maps(s.lights, archive);
  archive.append("light_sampled", s.light_sampled);
  archive.keep("quantum", std::vector<double>{s.scale.quantum, double(s.scale.digits)});
  if (s.counts_in_discs()) archive.append("area", s.area);
  for (const segments::BounceSegments& stored : s.store.bounces())
    level_sizes.push_back(stored.size());
  archive.keep("level_sizes", level_sizes);
  archive.keep("direct.scales",
               std::vector<double>{direct_->scales().quantum, direct_->scales().reference});
}

ArchiveView Session::save(bool shared) const {
  check_whole();
  check_looked();
  const State& s = *state_;
  ArchiveView archive;
  save_scene(archive);
  if (!baked_) return archive;
  save_bake(archive);
  archive.append("cut", s.cut);
  std::vector<uint32_t> pending;  // without known hits, which only save time
  for (const PendingPath& p : pending_) pending.insert(pending.end(), {p.path, p.slot, p.bounce});
  archive.keep("pending", pending);
  if (s.counts_in_discs()) {
    if (s.holds_none() && !shared)
      archive.keep("sums", std::vector<int64_t>(s.sums.size()));  // the parts store their own
    else
      archive.append("sums", s.sums);
  }
  for (size_t b = 0; b < s.store.bounces().size(); ++b) append_bounce(s, b, archive);
  if (s.options.range && !shared) archive.keep("edits", std::vector<uint64_t>{s.edits});
  if (s.evaluates()) direct_->save(archive);
  if (s.gather) s.guiding.save(archive, s.evaluates() && !(s.gather->looks.pending_share() > 0));
  if (s.gather && s.evaluates()) s.gather->looks.save(archive);
  return archive;
}

ArchiveView Session::save_choices() const {
  check_whole();
  ArchiveView archive;
  save_scene(archive);
  if (!baked_) return archive;
  save_bake(archive);
  archive.keep("edits", std::vector<uint64_t>{state_->edits});
  if (state_->gather) state_->guiding.save_asked(archive);
  return archive;
}

void Session::restore(ArchiveSource& archive, Progress& progress) {
  State& s = *state_;
  restore_scene(archive);
  if (!archive.bytes("level_sizes")) return;
  restore_lights(archive);
  const bool traced = brings_paths(s, archive), discs = s.counts_in_discs();
  if (traced && discs) archive.expect<int64_t>("sums", s.sum_count());
  if (discs) archive.expect<float>("area", s.samples.size());
  index_triangles(progress);
  Parts parts;
  if (discs) parts = restore_discs(archive, progress);
  plan_parts(parts, discs ? walk_pilot_paths(s, progress) : PilotPaths{}, false, progress);
  make_estimators(parts, progress);
  make_cells(progress);
  if (traced) {
    restore_segments(archive, progress);
    if (discs) s.sums = archive.read_all<int64_t>("sums", s.sum_count());
    snapshot::check_sums(s.sums, s.store.live());
    s.cut = archive.read_all<uint16_t>("cut", s.held.size());
    restore_pending(archive);
  } else {
    archive.read_all<uint64_t>("level_sizes", archive.count<uint64_t>("level_sizes"));
    s.sums.assign(s.sum_count(), 0);
    wait_for_paths();
  }
  if (s.options.range && archive.bytes("edits"))
    s.edits = archive.read_all<uint64_t>("edits", 1)[0];
  for (MovingPart& part : s.moving) {
    place_part(s, part);
    part.current = true;
  }
  restore_direct(archive);
  restore_looks(archive, progress);
  baked_ = true;
}

Parts Session::restore_discs(ArchiveSource& archive, Progress& progress) {
  State& s = *state_;
  std::vector<float> openness;  // empty: this part of a bake that has only begun computes its own
  if (s.holds_all() || archive.bytes("openness"))
    openness = archive.read_all<float>("openness", s.samples.size());
  snapshot::check_range("openness", openness, 0, samples::kMaxOpenness);
  s.area = archive.read_all<float>("area", s.samples.size());
  snapshot::check_areas(s.area, s.samples.radius, openness);
  Parts parts = place_parts(progress, openness);
  take_places(parts, !openness.empty());
  return parts;
}

void Session::restore_scene(ArchiveSource& archive) {
  State& s = *state_;
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
    check(scene::SetReflectance{uint32_t(m), own}, {});
    s.scene.materials[m].reflectance = own;
  }
  s.group_factor = archive.read_all<double>("group_factor", s.scene.group_count);
  for (uint32_t group = 0; group < s.scene.group_count; ++group)
    check(scene::Dim{group, s.group_factor[group]}, {});
  auto radius = archive.read_all<float>("radius", s.samples.size());
  snapshot::check_radii(radius, s.samples.radius, s.scene.first_world(),
                        archive.bytes("level_sizes") && !s.options.gather_rays);
  for (size_t i = 0; i < radius.size(); ++i)
    if (!std::isnan(radius[i]))
      s.samples.radius[i] = radius[i];  // leave our own quiet NaN in place of the file's
  for (trace::Light& light : s.lights) trace::place_light(s.scene, light);
}

void Session::restore_lights(ArchiveSource& archive) {
  State& s = *state_;
  const auto light_paths = archive.read_all<uint64_t>("light_paths", s.lights.size());
  snapshot::check_range("light_paths", light_paths, 1, double(UINT32_MAX));
  uint64_t paths = 0;
  for (size_t i = 0; i < s.lights.size(); ++i) {
    s.lights[i].first_path = paths;
    s.lights[i].path_count = light_paths[i];
    paths += light_paths[i];
  }
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
  s.hold_paths();
  if (brings_paths(s, archive)) archive.expect<uint16_t>("cut", s.held.size());
  s.light_sampled = archive.read_all<uint8_t>("light_sampled", s.lights.size());
  snapshot::check_range("light_sampled", s.light_sampled, 0, 1);
  const auto finer = archive.read_all<int32_t>("light_finer", s.lights.size());
  snapshot::check_range("light_finer", finer, trace::kLeastFineness, trace::kMostFineness);
  for (size_t i = 0; i < s.lights.size(); ++i) s.lights[i].finer = finer[i];
  s.share_sums();
  lay_out_cell_sums(s);
  for (const trace::Light& light : s.lights)
    // throws if the quantum is too fine
    trace::birth_quanta(light, s.scale, s.birth_factor(light));
}

void Session::restore_segments(ArchiveSource& archive, Progress& progress) {
  State& s = *state_;
  s.store = segments::SegmentStore(s.scene.world(), s.extras());
  const segments::Extras extras = s.extras();
  const uint32_t cells = s.gather ? s.gather->cells.size() : 0;
  const auto sizes =
      archive.read_all<uint64_t>("level_sizes", archive.count<uint64_t>("level_sizes"));
  snapshot::check_level_sizes(sizes, s.held.size(), s.options.max_bounces);
  uint64_t total = 0;
  for (size_t b = 0; b < sizes.size(); ++b, total += sizes[b - 1]) {
    archive.expect<segments::Segment>(level_name(b, "segments"), sizes[b]);
    archive.expect<segments::HitSlots>(level_name(b, "hits"), s.counts_in_discs() ? sizes[b] : 0);
    archive.expect<float>(level_name(b, "extended"), extras.extended ? sizes[b] : 0);
    if (extras.landing) archive.expect<uint32_t>(level_name(b, "landing"), sizes[b]);
  }
  progress.begin("restore segments", total);
  const snapshot::SegmentCheck check(s.scene, s.all_paths(), s.static_index->discs().size());
  std::vector<uint32_t> slots, unused;
  for (uint32_t b = 0; b < sizes.size(); ++b) {
    segments::BounceSegments& stored = s.store.bounce(b);
    stored.allocate(sizes[b], extras, slots);
    unused.clear();
    for (uint32_t begin = 0; begin < sizes[b]; begin += kPerChunk) {
      segments::BounceSegments::Chunk& chunk = stored.chunk(begin);
      const uint32_t count = uint32_t(std::min<uint64_t>(kPerChunk, sizes[b] - begin));
      archive.read(level_name(b, "segments"), std::span(chunk.segment).first(count));
      if (s.counts_in_discs())
        archive.read(level_name(b, "hits"), std::span(chunk.slots).first(count));
      if (extras.extended)
        archive.read(level_name(b, "extended"), std::span(chunk.extended.get(), count));
      if (extras.landing)
        archive.read(level_name(b, "landing"), std::span(chunk.landing.get(), count));
      for (uint32_t slot = begin; slot < begin + count; ++slot) {
        segments::Segment& g = stored.at(slot);
        if (g.length < 0) {
          g = segments::unused_segment(g.path);
          stored.slots(slot) = {};
          if (b > 0) unused.push_back(slot);
          continue;
        }
        check(g, stored.extended_or_length(slot), stored.slots(slot), b);
        if (extras.landing && stored.landing(slot) != gather::kNoCell &&
            stored.landing(slot) >= cells)
          snapshot::refuse("\"" + level_name(b, "landing") + "\" names a cell that is not there");
        s.store.index(b, slot);
      }
      progress.advance(count);
      progress.check();
    }
    for (uint32_t slot : unused) stored.release(slot);
  }
  snapshot::check_chains(s.store, s.held);
}

void Session::wait_for_paths() {
  State& s = *state_;
  s.store = segments::SegmentStore(s.scene.world(), s.extras());
  std::vector<uint32_t> slots;
  s.store.bounce(0).allocate(s.held.size(), s.store.extras(), slots);
  s.cut.assign(s.held.size(), 0);
  for (const uint32_t slot : slots) {
    const uint32_t path = s.held.path_of(slot);
    s.store.bounce(0).at(slot) = segments::unused_segment(path);
    pending_.push_back({path, slot, 0, false, {}});
  }
}

void Session::restore_pending(ArchiveSource& archive) {
  const size_t count = archive.count<uint32_t>("pending");
  if (count % 3 || count / 3 > state_->cut.size()) snapshot::refuse("\"pending\" is incomplete");
  const auto pending = archive.read_all<uint32_t>("pending", count);
  for (size_t i = 0; i < pending.size(); i += 3) {
    if (pending[i + 2] >= kNotCut) snapshot::refuse("\"pending\" names a bounce that is not there");
    pending_.push_back({pending[i], pending[i + 1], uint16_t(pending[i + 2]), false, {}});
  }
  snapshot::check_pending(pending_, state_->cut, state_->store, state_->held);
}

}  // namespace deltalux::session
