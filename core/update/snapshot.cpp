// SPDX-License-Identifier: Apache-2.0
// Session state as named byte arrays, and back. The scene, samples and options travel with the
// caller, who makes a fresh session of them; this restores what baking and editing made of it.
#include <cstring>

#include "base/error.h"
#include "update/pilot_paths.h"
#include "update/session.h"
#include "update/session_parts.h"
#include "update/snapshot_check.h"

namespace deltalux::update {
namespace {

template <class T>
std::vector<std::byte> pack(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  std::vector<std::byte> out(values.size() * sizeof(T));
  if (!out.empty()) std::memcpy(out.data(), values.data(), out.size());
  return out;
}

template <class T>
std::vector<T> unpack(const Session::Archive& archive, const std::string& name, size_t expected) {
  const auto entry = archive.find(name);
  if (entry == archive.end()) throw FormatError("session file: \"" + name + "\" is missing");
  if (entry->second.size() != expected * sizeof(T))
    throw FormatError("session file: \"" + name + "\" holds " +
                      std::to_string(entry->second.size()) + " bytes, expected " +
                      std::to_string(expected * sizeof(T)));
  std::vector<T> out(expected);
  if (expected) std::memcpy(out.data(), entry->second.data(), entry->second.size());
  return out;
}

/// The same where the number of entries is not known.
template <class T>
std::vector<T> unpack_all(const Session::Archive& archive, const std::string& name) {
  const auto entry = archive.find(name);
  return unpack<T>(archive, name, entry == archive.end() ? 0 : entry->second.size() / sizeof(T));
}

}  // namespace

Session::Archive Session::save() const {
  check_whole();
  const State& s = *state_;
  Archive archive;
  std::vector<double> poses;
  std::vector<uint8_t> present;
  for (const scene::Object& object : s.scene.objects) {
    for (const Vec3d& row : object.pose.row) poses.insert(poses.end(), {row.x, row.y, row.z});
    const Vec3d t = object.pose.translation;
    poses.insert(poses.end(), {t.x, t.y, t.z});
    present.push_back(object.present);
  }
  std::vector<float> reflectance;
  for (const scene::Material& m : s.scene.materials)
    reflectance.insert(reflectance.end(), {m.reflectance.x, m.reflectance.y, m.reflectance.z});
  const Box& world = s.scene.world();
  archive["world"] = pack(std::vector<Vec3f>{world.low, world.high});
  archive["poses"] = pack(poses);
  archive["present"] = pack(present);
  archive["reflectance"] = pack(reflectance);
  archive["group_factor"] = pack(s.group_factor);
  archive["radius"] = pack(s.samples.radius);
  if (!baked_) return archive;
  std::vector<float> openness(s.samples.size());
  const auto note = [&](const samples::DiscSet& discs) {
    for (size_t i = 0; i < discs.size(); ++i) openness[discs.id[i]] = discs.openness[i];
  };
  note(s.static_index->discs());
  for (const MovingPart& part : s.moving) note(part.index->discs());
  archive["openness"] = pack(openness);

  std::vector<uint64_t> light_paths, level_sizes;
  for (const trace::Light& light : s.lights) light_paths.push_back(light.path_count);
  archive["light_paths"] = pack(light_paths);
  archive["light_sampled"] = pack(s.light_sampled);
  archive["quantum"] = pack(std::vector<double>{s.scale.quantum});
  archive["cut"] = pack(s.cut);
  std::vector<uint32_t> pending;  // known hits are left out: they only save time
  for (const PendingPath& p : pending_) pending.insert(pending.end(), {p.path, p.slot, p.bounce});
  archive["pending"] = pack(pending);
  archive["sums"] = pack(s.sums);
  archive["area"] = pack(s.area);
  for (size_t b = 0; b < s.store.levels().size(); ++b) {
    const segments::Level& level = s.store.levels()[b];
    level_sizes.push_back(level.size());
    std::vector<segments::Segment> records(level.size());
    std::vector<segments::HitSlots> hits(level.size());
    std::vector<float> extended(s.store.with_extended() ? level.size() : 0);
    for (uint32_t slot = 0; slot < level.size(); ++slot) {
      const segments::Level::Chunk& chunk = level.chunk(slot);
      records[slot] = chunk.segment[slot % segments::Level::kChunk];
      hits[slot] = chunk.slots[slot % segments::Level::kChunk];
      if (!extended.empty()) extended[slot] = level.extended_or_length(slot);
    }
    const std::string prefix = "level" + std::to_string(b) + ".";
    archive[prefix + "segments"] = pack(records);
    archive[prefix + "hits"] = pack(hits);
    archive[prefix + "extended"] = pack(extended);
  }
  archive["level_sizes"] = pack(level_sizes);
  archive["direct.quantum"] = pack(std::vector<double>{direct_->irradiance_quantum()});
  direct_->save(archive);
  return archive;
}

void Session::restore(const Archive& archive, Progress& progress) {
  State& s = *state_;
  const size_t objects = s.scene.objects.size();
  const auto poses = unpack<double>(archive, "poses", 12 * objects);
  const auto present = unpack<uint8_t>(archive, "present", objects);
  const std::vector<scene::Object> original = s.scene.objects;
  for (size_t i = 0; i < objects; ++i) {
    const double* p = poses.data() + 12 * i;
    Pose& pose = s.scene.objects[i].pose;
    for (int r = 0; r < 3; ++r) pose.row[r] = {p[3 * r], p[3 * r + 1], p[3 * r + 2]};
    pose.translation = {p[9], p[10], p[11]};
    s.scene.objects[i].present = present[i] != 0;
  }
  // The scene's own measure would count meshes that were added since.
  const auto world = unpack<Vec3f>(archive, "world", 2);
  s.scene.set_world({world[0], world[1]});
  snapshot::check_poses(original, s.scene);
  const auto reflectance = unpack<float>(archive, "reflectance", 3 * s.scene.materials.size());
  for (size_t m = 0; m < s.scene.materials.size(); ++m)
    s.scene.materials[m].reflectance = {reflectance[3 * m], reflectance[3 * m + 1],
                                        reflectance[3 * m + 2]};
  snapshot::check_range("reflectance", reflectance, 0, 1);
  s.group_factor = unpack<double>(archive, "group_factor", s.scene.group_count);
  snapshot::check_range("group_factor", s.group_factor, 0, 1e6);
  s.samples.radius = unpack<float>(archive, "radius", s.samples.size());
  for (trace::Light& light : s.lights) trace::place_light(s.scene, light);
  if (!archive.contains("level_sizes")) return;

  const auto light_paths = unpack<uint64_t>(archive, "light_paths", s.lights.size());
  uint64_t paths = 0;
  snapshot::check_range("light_paths", light_paths, 0, double(UINT32_MAX));
  for (size_t i = 0; i < s.lights.size(); ++i) {
    s.lights[i].first_path = paths;
    s.lights[i].path_count = light_paths[i];
    paths += light_paths[i];
  }
  if (paths > (uint64_t(1) << 32) / s.options.max_bounces)
    snapshot::refuse("\"light_paths\": found " + std::to_string(paths) + " paths, more than fit");
  s.light_sampled = unpack<uint8_t>(archive, "light_sampled", s.lights.size());
  snapshot::check_range("light_sampled", s.light_sampled, 0, 1);
  const auto quantum = unpack<double>(archive, "quantum", 1);
  snapshot::check_range("quantum", quantum, 0, 1e300);
  s.scale.quantum = quantum[0];
  for (const trace::Light& light : s.lights)
    trace::birth_quanta(light, s.scale,
                        s.birth_factor(light));  // refuses one that does not hold it
  const auto openness = unpack<float>(archive, "openness", s.samples.size());
  snapshot::check_range("openness", openness, 0, 1e6);
  Parts parts = place_parts(progress, openness);
  plan_parts(parts, walk_pilot_paths(s, progress), false, progress);
  make_estimators(parts, progress);
  s.cut = unpack<uint8_t>(archive, "cut", paths);
  s.sums =
      unpack<int64_t>(archive, "sums", size_t(s.sum_groups()) * kBatches * s.samples.size() * 3);
  s.area = unpack<float>(archive, "area", s.samples.size());
  snapshot::check_range("radius", s.samples.radius, 0, kFarthest);
  snapshot::check_range("area", s.area, 0, 1e30);
  s.store =
      segments::SegmentStore(s.scene.world(), s.options.segment_end != segments::SegmentEnd::first);
  const auto sizes = unpack_all<uint64_t>(archive, "level_sizes");
  const size_t bounces = sizes.size();
  if (bounces > s.options.max_bounces + 1u)
    snapshot::refuse("\"level_sizes\" has too many bounces");
  progress.begin("restore segments", bounces);
  for (uint32_t b = 0; b < bounces; ++b) {
    const std::string prefix = "level" + std::to_string(b) + ".";
    const auto records = unpack<segments::Segment>(archive, prefix + "segments", sizes[b]);
    const auto hits = unpack<segments::HitSlots>(archive, prefix + "hits", sizes[b]);
    const auto extended =
        unpack<float>(archive, prefix + "extended", s.store.with_extended() ? sizes[b] : 0);
    segments::Level& level = s.store.level(b);
    std::vector<uint32_t> slots;
    level.allocate(sizes[b], s.store.with_extended(), slots);
    for (uint32_t slot = 0; slot < sizes[b]; ++slot) {
      const segments::Segment& g = records[slot];
      for (uint32_t disc : hits[slot].disc)
        if (disc < segments::HitSlots::kMany && disc >= s.static_index->discs().size())
          snapshot::refuse("a segment refers to a disc that is not there");
      level.at(slot) = g.length < 0 ? segments::unused_segment(g.path) : g;
      level.slots(slot) = hits[slot];
      if (!extended.empty()) level.extended(slot) = extended[slot];
      if (g.length >= 0)
        s.store.index(b, slot);
      else if (b > 0)
        level.release(slot);
    }
    progress.advance(1);
  }
  snapshot::check_segments(s.store, s.scene, paths);
  const auto pending = unpack_all<uint32_t>(archive, "pending");
  if (pending.size() % 3) snapshot::refuse("\"pending\" is incomplete");
  for (size_t i = 0; i < pending.size(); i += 3)
    pending_.push_back({pending[i], pending[i + 1], uint8_t(pending[i + 2]), false, {}});
  snapshot::check_pending(pending_, s.cut, s.store);
  for (MovingPart& part : s.moving) {
    place_part(s, part);
    part.current = true;
  }
  restore_direct(archive, progress);
  baked_ = true;
}

}  // namespace deltalux::update
