// SPDX-License-Identifier: Apache-2.0
// Edits: validation, what they touch, and the replacement of the paths they change.
#include <algorithm>
#include <chrono>
#include <numbers>

#include "base/error.h"
#include "update/pending.h"
#include "update/session.h"

namespace deltalux::update {
namespace {

constexpr double kDirectShare = 0.4;  // of a time budget, for shadow rays
constexpr size_t kFirstStep = 128;    // with a time budget it measures how many paths fit

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// The object that an edit means: in the scene, or inserted by one of the edits `before` it.
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

void check_inside(const scene::Scene& scene, const scene::Object& object, const Box& bounds) {
  if (!scene.world().contains(bounds))
    throw OptionError("\"" + object.name +
                      "\" would leave the box that the session was baked for (the scene's bounds); "
                      "move it inside, or start a new session with it there");
}

/// The lights of a new object. Their paths carry about as much as the others', so that noise stays
/// even.
std::vector<trace::Light> new_lights(const State& s, const scene::Scene& scene, uint32_t object) {
  std::vector<trace::Light> lights = trace::find_lights(scene, object);
  uint64_t next = s.lights.empty() ? 0 : s.lights.back().first_path + s.lights.back().path_count;
  for (trace::Light& light : lights) {
    const double rows = std::max({light.power.x, light.power.y, light.power.z}) /
                        (s.scale.quantum * 0x1p29 * kBatches);
    light.first_path = next;
    light.path_count = kBatches * uint64_t(std::clamp(rows, 1.0, 0x1p40));
    next += light.path_count;
  }
  return lights;
}

PendingPath whole_path(uint32_t path) { return {path, path, 0, false, {}}; }

/// Paths of new lights wait like those that are cut: as segments that are not in use yet.
void add_paths(State& s, EditMarks& marks) {
  const size_t all = s.lights.back().first_path + s.lights.back().path_count;
  std::vector<uint32_t> slots;
  s.store.level(0).allocate(all - s.cut.size(), s.store.with_extended(), slots);
  s.cut.resize(all, kNotCut);
  for (uint32_t slot : slots) {
    s.store.level(0).at(slot) = segments::unused_segment(slot);
    s.store.level(0).slots(slot) = {};
    marks.mark(whole_path(slot));
  }
}

std::string mebibytes(double bytes) { return std::to_string(uint64_t(bytes) >> 20) + " MiB"; }

}  // namespace

void Session::check_insert(const scene::Object& object, std::span<const scene::Edit> before) const {
  const State& s = *state_;
  if (!baked_) throw OptionError("add: bake the session before adding a new mesh");
  const std::string what = "add \"" + object.name + "\": ";
  s.scene.check(object);
  check_inside(s.scene, object, bounds_at(object, object.pose));
  uint64_t more = 0;
  double brightest = 0;
  const auto count = [&](const scene::Object& own) {
    scene::Scene alone;
    alone.materials = s.scene.materials;
    alone.objects.push_back(own);
    for (const trace::Light& light : new_lights(s, alone, 0)) {
      more += light.path_count;
      brightest = std::max({brightest, double(light.radiance.x), double(light.radiance.y),
                            double(light.radiance.z)});
    }
  };
  for (const scene::Edit& edit : before)
    if (const auto* insert = std::get_if<scene::Insert>(&edit)) count(insert->object);
  count(object);
  if (!more) return;
  const uint64_t paths = s.cut.size(), most = (uint64_t(1) << 32) / s.options.max_bounces;
  if (more > most - std::min(most, paths))
    throw OptionError(what + "its light needs " + std::to_string(more) + " paths beside the " +
                      std::to_string(paths) + " of the session, expected at most " +
                      std::to_string(most) +
                      " in all so that no integer sum can overflow; "
                      "start a new session with it in the scene");
  if (s.options.direct == DirectMode::sampled &&
      std::numbers::pi * brightest > direct::kMostWeight * direct_->irradiance_quantum())
    throw OptionError(what +
                      "its light is brighter than the session's integer scale holds; start a "
                      "new session with it in the scene");
  const double per_path =
      paths ? double(s.store.bytes()) / double(paths) : 4.0 * sizeof(segments::Segment);
  const double needed = double(bytes()) + per_path * double(more);
  if (s.options.memory_limit && needed > double(s.options.memory_limit))
    throw OptionError(what + "memory: with the paths of its light the session would need about " +
                      mebibytes(needed) + ", the limit is " +
                      mebibytes(double(s.options.memory_limit)) +
                      "; raise the memory limit, or start a new session with it in the scene");
}

void Session::check(const scene::Edit& edit, std::span<const scene::Edit> before) const {
  const scene::Scene& scene = state_->scene;
  if (const auto* move = std::get_if<scene::Move>(&edit)) {
    const scene::Object& object = movable_object(scene, before, move->object);
    check_inside(scene, object,
                 move->object < scene.objects.size() ? scene.bounds_at(move->object, move->pose)
                                                     : bounds_at(object, move->pose));
  } else if (const auto* presence = std::get_if<scene::SetPresent>(&edit)) {
    movable_object(scene, before, presence->object);
  } else if (const auto* insert = std::get_if<scene::Insert>(&edit)) {
    check_insert(insert->object, before);
  } else if (const auto* dim = std::get_if<scene::Dim>(&edit)) {
    if (dim->group >= scene.group_count) throw OptionError("dim: no such group");
    if (!(dim->factor >= 0) || !(dim->factor <= 1e6))
      throw OptionError("dim: found factor " + std::to_string(dim->factor) +
                        ", expected 0 to 1e6 (1 = as loaded)");
    if (state_->merged(dim->group) && dim->factor > 1.5)
      throw OptionError(
          "dim: more than eight groups share sums, and this one has no room for a "
          "factor above 1.5");
  } else if (const auto* paint = std::get_if<scene::SetReflectance>(&edit)) {
    if (paint->material >= scene.materials.size())
      throw OptionError("reflectance: no such material");
    for (int c = 0; c < 3; ++c)
      if (!(paint->reflectance[c] >= 0 && paint->reflectance[c] <= 1))
        throw OptionError("reflectance: expected 0 to 1 per channel");
  }
}

Report Session::update(std::span<const scene::Edit> edits, double budget_ms, Progress& progress) {
  edits_applied_ = false;
  for (size_t i = 0; i < edits.size(); ++i) check(edits[i], edits.first(i));
  State& s = *state_;
  Report report;
  const Clock::time_point begin = Clock::now();

  // The state after all edits; only what really differs counts as a change.
  scene::Scene& scene = s.scene;
  const std::vector<double> old_factors = s.group_factor;
  const std::vector<scene::Material> old_materials = scene.materials;
  std::vector<std::pair<Pose, bool>> old_objects;
  for (const scene::Object& object : scene.objects)
    old_objects.emplace_back(object.pose, object.present);
  const size_t old_lights = s.lights.size();
  std::vector<uint32_t> inserted;
  for (const scene::Edit& edit : edits) {
    if (const auto* move = std::get_if<scene::Move>(&edit)) {
      scene.objects[move->object].pose = move->pose;
    } else if (const auto* presence = std::get_if<scene::SetPresent>(&edit)) {
      scene.objects[presence->object].present = presence->present;
    } else if (const auto* dim = std::get_if<scene::Dim>(&edit)) {
      s.group_factor[dim->group] = dim->factor;
    } else if (const auto* paint = std::get_if<scene::SetReflectance>(&edit)) {
      scene.materials[paint->material].reflectance = paint->reflectance;
    } else if (const auto* insert = std::get_if<scene::Insert>(&edit)) {
      inserted.push_back(scene.add_object(insert->object));
    }
  }
  const auto place_lights = [&] {
    for (trace::Light& light : s.lights) {
      if (light.object == scene::kNone || light.object >= old_objects.size()) continue;
      const scene::Object& object = scene.objects[light.object];
      const auto& [pose, present] = old_objects[light.object];
      if (object.pose != pose || object.present != present) trace::place_light(scene, light);
    }
  };
  place_lights();
  if (!baked_) {
    edits_applied_ = true;
    return report;
  }

  Clock::time_point lap = Clock::now();
  const auto stage = [&](const char* name) {
    report.milliseconds.emplace_back(name, since(lap));
    lap = Clock::now();
  };
  std::vector<ObjectChange> changes;
  for (uint32_t i = 0; i < scene.objects.size(); ++i) {
    const bool fresh = i >= old_objects.size();
    if (!fresh && scene.objects[i].pose == old_objects[i].first &&
        scene.objects[i].present == old_objects[i].second)
      continue;
    ObjectChange change{i, fresh ? Box{} : s.caster->object_bounds(i), {}};
    s.caster->update_object(scene, i);
    change.after = s.caster->object_bounds(i);
    // Even where it is absent before and after: its samples have moved.
    changes.push_back(change);
  }
  stage("geometry");
  std::vector<uint8_t> materials;
  for (size_t m = 0; m < scene.materials.size(); ++m)
    if (scene.materials[m].reflectance != old_materials[m].reflectance) {
      materials.resize(scene.materials.size(), 0);
      materials[m] = 1;
    }
  for (uint32_t object : inserted)
    for (trace::Light& light : new_lights(s, scene, object)) {
      s.lights.push_back(std::move(light));
      s.light_sampled.push_back(s.options.direct == DirectMode::sampled);
    }

  Affected affected;
  try {
    for (MovingPart& part : s.moving) place_part(s, part);
    if (!changes.empty() || !materials.empty())
      affected = find_affected(s, changes, materials, progress);
    stage("scan");
    update_direct(changes, old_lights, kDirectShare * budget_ms, progress);
    stage("direct");
  } catch (...) {
    // Nothing was written yet but the state itself: put it back.
    s.group_factor = old_factors;
    scene.materials = old_materials;
    s.lights.resize(old_lights);
    s.light_sampled.resize(old_lights);
    for (uint32_t i = 0; i < old_objects.size(); ++i) {
      scene.objects[i].pose = old_objects[i].first;
      scene.objects[i].present = old_objects[i].second;
    }
    for (size_t i = 0; i < inserted.size(); ++i) {
      scene.drop_last_object();
    }
    s.caster->drop_objects(scene.objects.size());
    for (const ObjectChange& change : changes)
      if (change.object < scene.objects.size()) s.caster->update_object(scene, change.object);
    for (trace::Light& light : s.lights) trace::place_light(scene, light);
    for (MovingPart& part : s.moving) place_part(s, part);
    place_receivers(nullptr);
    throw;
  }
  edits_applied_ = true;
  report.scanned_segments = affected.scanned;
  report.candidates = affected.candidates;

  // A path is cut at the earliest bounce that any edit touches.
  EditMarks marks(s, pending_);
  // Lights first: their paths are born anew, along other rays than the search saw.
  for (size_t l = 0; l < old_lights; ++l) {
    const trace::Light& light = s.lights[l];
    const bool moved = std::any_of(changes.begin(), changes.end(),
                                   [&](const auto& c) { return c.object == light.object; });
    const bool dimmed =
        s.merged(light.group) && s.group_factor[light.group] != old_factors[light.group];
    if (moved || dimmed)
      for (uint64_t i = 0; i < light.path_count; ++i)
        marks.mark(whole_path(uint32_t(light.first_path + i)));
  }
  for (uint32_t b = 0; b < affected.segments.size(); ++b)
    for (const AffectedSegment& segment : affected.segments[b])
      marks.mark({s.store.level(b).at(segment.slot).path, segment.slot, uint8_t(b),
                  segment.hit_known, segment.hit});
  if (s.lights.size() > old_lights) add_paths(s, marks);
  if (budget_ms > 0) marks.order();

  // Samples of moved objects start again from the stored segments near the new pose.
  std::vector<size_t> rebuild;
  for (MovingPart& part : s.moving)
    for (size_t k = 0; k < changes.size(); ++k)
      if (changes[k].object == part.object) {
        part.current = false;
        rebuild.push_back(k);
      }
  const auto between = [&] {
    Deposit deposit(s);
    for (size_t k : rebuild)
      for (MovingPart& part : s.moving) {
        if (part.object != changes[k].object) continue;
        clear_part(s, part);
        part.current = true;
        if (!scene.objects[part.object].present) continue;
        for (uint32_t b = 0; b < affected.near[k].size(); ++b)
          deposit.add_to_part(part, b, affected.near[k][b]);
      }
    deposit.finish();
    rebuild.clear();
  };
  run_pending(budget_ms > 0 ? budget_ms - since(begin) : 0, progress, report, between);
  lap = Clock::now();
  if (!changes.empty()) refresh_areas(&changes);
  stage("areas");
  report.milliseconds.emplace_back("total", since(begin));
  if (!pending_.empty() && progress.cancelled()) throw Cancelled();
  return report;
}

void Session::run_pending(double budget_ms, Progress& progress, Report& report,
                          const std::function<void()>& between) {
  const Clock::time_point start = Clock::now();
  const size_t total = pending_.size();
  size_t done = 0;
  PathUpdate update(*state_);
  progress.announce("replace paths", total);
  // The moving samples come in the first step, which always runs: from then on they follow every
  // replacement as the static ones do.
  size_t step = budget_ms != 0 ? kFirstStep : kMostPerStep;
  do {
    const size_t end = std::min(total, done + step);
    update.replace(std::span(pending_).subspan(done, end - done), done ? nullptr : between);
    progress.advance(end - done);
    done = end;
    if (budget_ms == 0 || done == total) continue;
    const double spent = since(start), left = budget_ms - spent;
    if (left <= 0) break;
    const double fits = double(done) * left / spent;  // beyond any integer, perhaps
    step = size_t(std::clamp(fits, 1.0, double(std::min(2 * step, kMostPerStep))));
  } while (done < total && !progress.cancelled());
  pending_.erase(pending_.begin(), pending_.begin() + long(done));
  report.affected_paths = update.counts().paths;
  report.removed_segments = update.counts().removed;
  report.traced_segments = update.counts().traced;
  report.done = std::min(direct_->current_share(), total ? double(done) / double(total) : 1.0);
  report.milliseconds.emplace_back("remove", update.counts().remove_ms);
  report.milliseconds.emplace_back("moving samples", update.counts().moving_ms);
  report.milliseconds.emplace_back("trace", update.counts().trace_ms);
  report.milliseconds.emplace_back("deposit", update.counts().deposit_ms);
}

}  // namespace deltalux::update
