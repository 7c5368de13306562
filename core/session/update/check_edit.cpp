// SPDX-License-Identifier: Apache-2.0
// An edit is checked against the scene that the edits before it leave.
#include "session/update/check_edit.h"

#include <string>
#include <vector>

#include "base/error.h"
#include "session/flow/edit_log.h"
#include "session/flow/reach.h"

namespace deltalux::session {
namespace {

/// The object that an edit refers to: one of the scene, or one inserted by the edits `before` it.
const scene::Object& movable_object(const scene::Scene& scene, std::span<const scene::Edit> before,
                                    uint32_t index) {
  if (index < scene.objects.size()) {
    const scene::Object& object = scene.objects[index];
    if (!object.movable)
      throw OptionError("\"" + object.name + "\" is static; list it in `movable` to edit it");
    return object;
  }
  size_t number = index - scene.objects.size();
  for (const scene::Edit& edit : before)
    if (const auto* insert = std::get_if<scene::Insert>(&edit); insert && number-- == 0)
      return insert->object;
  throw OptionError("edit: no such object");
}

void check_place(const State& s, const scene::Object& object, const Box& bounds) {
  const std::string refusal = Reach(s).refusal(bounds);
  if (!refusal.empty()) throw OptionError("\"" + object.name + "\" " + refusal);
}

/// Number of light groups after these edits.
uint32_t groups_after(const scene::Scene& scene, std::span<const scene::Edit> edits) {
  uint32_t groups = scene.group_count;
  for (const scene::Edit& edit : edits)
    if (const auto* insert = std::get_if<scene::Insert>(&edit))
      groups = scene::groups_with(insert->object, groups);
  return groups;
}

/// The dim factor of a group after these edits.
double factor_after(const State& s, uint32_t group, std::span<const scene::Edit> edits) {
  double factor = group < s.group_factor.size() ? s.group_factor[group] : 1.0;
  for (const scene::Edit& edit : edits)
    if (const auto* dim = std::get_if<scene::Dim>(&edit); dim && dim->group == group)
      factor = dim->factor;
  return factor;
}

/// The lights of inserted objects.
struct AddedLights {
  std::vector<trace::Light> lights;
  uint64_t paths = 0;
};

AddedLights lights_of_inserts(const State& s, std::span<const scene::Edit> before,
                              const scene::Object& object) {
  AddedLights added;
  uint32_t groups = s.scene.group_count;
  const auto add = [&](const scene::Object& own) {
    groups = scene::groups_with(own, groups);
    scene::Scene alone;
    alone.materials = s.scene.materials;
    alone.group_count = groups;
    alone.objects.push_back(own);
    alone.finish();
    for (const trace::Light& light : added_lights(s, alone, 0, groups)) {
      added.lights.push_back(light);
      added.paths += light.path_count;
    }
  };
  for (const scene::Edit& edit : before)
    if (const auto* insert = std::get_if<scene::Insert>(&edit)) add(insert->object);
  add(object);
  return added;
}

/// Bytes of the sums that a session needs in addition for so many light groups in all, and for the
/// paths of these new lights.
double bytes_of_groups(const State& s, uint32_t groups, std::vector<trace::Light> added) {
  const double fresh = double(groups - s.scene.group_count);
  std::vector<SumGroup> all = s.sum_groups;
  assign_sums(added, all);
  const double sums = double(all.size() - s.sum_groups.size()) * kBatches;
  const double discs = s.counts_in_discs() ? double(s.samples.size()) : 0.0;
  const double cells = double(s.cells.division.size());
  const double receivers = s.evaluates() ? double(s.samples.size()) : 0.0;
  return 3 * sizeof(int64_t) * (sums * (discs + cells) + fresh * receivers);
}

constexpr double kMostShared = 1.5;  // dim factor that integer sums of several groups have room for
constexpr const char* kNoRoom =
    "more than eight groups share sums, and these have no room for a factor above 1.5";

/// The part of check() for objects that come with a new mesh.
void check_insert(const State& s, const scene::Object& object,
                  std::span<const scene::Edit> before) {
  if (!s.baked) throw OptionError("add: bake the session before adding a new mesh");
  const std::string what = "add \"" + object.name + "\": ";
  const uint32_t known = groups_after(s.scene, before);
  const uint32_t groups = scene::groups_with(object, known);
  s.scene.check(object, groups);
  check_place(s, object, bounds_at(object, object.pose));
  constexpr uint32_t kLast = kMaxOwnGroups - 1;
  if (World::merged(kLast, groups) && !World::merged(kLast, known) &&
      factor_after(s, kLast, before) > kMostShared)
    throw OptionError(what + "with its light group, " + kNoRoom +
                      "; give it one of the session's groups, or dim the eighth one first");
  const bool sampled = s.samples_added_lights();
  AddedLights added = lights_of_inserts(s, before, object);
  const uint64_t more = added.paths;
  if (!more && groups == s.scene.group_count) return;
  const uint64_t paths = s.all_paths(), most = s.scale.most_paths(s.options.max_bounces);
  if (more > most - std::min(most, paths))
    throw OptionError(what + "its light needs " + std::to_string(more) + " paths beside the " +
                      std::to_string(paths) + " of the session, expected at most " +
                      std::to_string(most) +
                      " in all so that no integer sum can overflow; "
                      "start a new session with it in the scene");
  const double per_path =
      paths ? double(s.paths.store.bytes()) / double(paths) : 4.0 * sizeof(segments::Segment);
  const double needed =
      double(s.needed_bytes()) + per_path * double(more) +
      bytes_of_groups(s, groups, added.lights) +
      double(direct::DirectLight::forecast_bytes(
          s.samples.size(), 0, added.lights, std::vector<uint8_t>(added.lights.size(), sampled)));
  if (s.options.memory_limit && needed > double(s.options.memory_limit))
    throw OptionError(what + "memory: with the paths of its light the session would need about " +
                      mebibytes(needed) + ", the limit is " +
                      mebibytes(double(s.options.memory_limit)) +
                      "; raise the memory limit, or start a new session with it in the scene");
}

}  // namespace

void check(const State& s, const scene::Edit& edit, std::span<const scene::Edit> before) {
  const scene::Scene& scene = s.scene;
  if (const auto* move = std::get_if<scene::Move>(&edit)) {
    const scene::Object& object = movable_object(scene, before, move->object);
    check_place(s, object,
                move->object < scene.objects.size() ? s.bounds_at(move->object, move->pose)
                                                    : bounds_at(object, move->pose));
  } else if (const auto* presence = std::get_if<scene::SetPresent>(&edit)) {
    movable_object(scene, before, presence->object);
  } else if (const auto* insert = std::get_if<scene::Insert>(&edit)) {
    check_insert(s, insert->object, before);
  } else if (const auto* dim = std::get_if<scene::Dim>(&edit)) {
    const uint32_t groups = groups_after(scene, before);
    if (dim->group >= groups) throw OptionError("dim: no such group");
    if (!(dim->factor >= 0) || !(dim->factor <= 1e6))
      throw OptionError("dim: found factor " + std::to_string(dim->factor) +
                        ", expected 0 to 1e6 (1 = as loaded)");
    if (World::merged(dim->group, groups) && dim->factor > kMostShared)
      throw OptionError(std::string("dim: ") + kNoRoom);
  } else if (const auto* paint = std::get_if<scene::SetReflectance>(&edit)) {
    if (paint->material >= scene.materials.size())
      throw OptionError("reflectance: no such material");
    for (int c = 0; c < 3; ++c)
      if (!(paint->reflectance[c] >= 0 && paint->reflectance[c] <= 1))
        throw OptionError("reflectance: expected 0 to 1 per channel");
  }
}

}  // namespace deltalux::session
