// SPDX-License-Identifier: Apache-2.0
// A session's State without a Session: a room with two lights, two movables, and discs that
// overlap. For tests of the functions that work on a State alone, and of what they leave in it.
#pragma once
#include <algorithm>
#include <map>
#include <tuple>

#include "base/direction.h"
#include "estimate/crossing.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate/ray_map/discs.h"
#include "session/flow/path_update.h"
#include "session/paths/pending.h"
#include "session_world.h"

namespace deltalux::session {

struct Variant {
  int threads = 1;
  segments::SegmentEnd end = segments::SegmentEnd::first;
  bool collects = false;  ///< whether the static samples have a method with long spans
  bool gathers = false;
  uint64_t paths = 4000;
  std::optional<PathRange> range{};
};

/// One segment as every State of the same scene has it, whatever its slots are.
using Piece = std::tuple<std::array<float, 3>, uint32_t, float, float, std::array<uint32_t, 3>,
                         uint32_t, uint32_t>;

inline Pose at(double x, double y, double z) {
  Pose pose;
  pose.translation = {x, y, z};
  return pose;
}

/// The pose after a turn of the object about one of its axes.
inline Pose turned(Pose pose, int axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const int b = (axis + 1) % 3, d = (axis + 2) % 3;
  for (Vec3d& row : pose.row) {
    const Vec3d old = row;
    row[b] = c * old[b] + s * old[d];
    row[d] = c * old[d] - s * old[b];
  }
  return pose;
}

/// The room with a wide spot of group 1, whose direct light comes from paths, the lamp of group 0,
/// which has shadow rays, the block (object 1) and a crate (object 2) close under a shelf.
inline scene::Scene room_of_two() {
  scene::Scene scene = room_with_spot();
  scene.lights[0].group = 1, scene.group_count = 2;
  scene.lights[0].intensity = {40, 30, 20}, scene.lights[0].parameters = {0.1f, 0.4f};
  scene.materials.push_back({{0.9f, 0.8f, 0.7f}, {}, false});
  direct::add_quad(scene.objects[0], {2.7f, 0.8f, 2.3f}, {0, 0, 0.6f}, {0.6f, 0, 0});
  scene::Object crate;
  crate.name = "crate";
  crate.movable = true;
  direct::add_box(crate, {-0.2f, -0.2f, -0.2f}, {0.2f, 0.2f, 0.2f});
  std::fill(crate.material.begin(), crate.material.end(), 2u);
  crate.pose = turned(at(3, 0.4, 2.6), 2, 0.2);
  scene.objects[1].pose = turned(scene.objects[1].pose, 1, 0.5);
  scene.objects.push_back(crate);
  scene.finish();
  return scene;
}

class StateWorld {
 public:
  explicit StateWorld(const Variant& variant, scene::Scene scene = room_of_two())
      : s(options_of(variant)) {
    s.scene = std::move(scene);
    s.samples = some_samples();
    for (int i = 0; i < 4; ++i) {
      s.samples.point.push_back({-0.15f + 0.1f * float(i), 0.2f, 0});
      s.samples.normal.push_back({0, 1, 0});
      s.samples.attached.push_back(2);
      s.samples.radius.push_back(0.15f);
    }
    s.caster = std::make_unique<trace::RayCaster>(s.scene, progress);
    s.lights = trace::find_lights(s.scene);
    trace::allot_paths(s.lights, trace::shares_by_power(s.lights), variant.paths, kBatches);
    s.light_sampled = {0, 1};
    s.group_factor.assign(s.scene.group_count, 1.0);
    s.scale = trace::choose_scale(s.lights, s.options.max_bounces);
    s.group_sums();
    make_discs(variant);
    if (variant.gathers) {
      s.cells.division = gather::Cells(s.scene, *s.caster, 1);
      s.cells.lay_out_sums();
    }
    s.paths.prepare();
    s.discs.sums.assign(size_t(s.slabs()) * s.samples.size() * 3, 0);
    s.paths.store.bounce(0).allocate(s.paths.held.size(), s.paths.store.extras(), first_slots_);
  }

  /// Traces all paths.
  void trace() { PathUpdate(s).start(first_slots_, progress); }

  /// Changes an object of the scene, as EditLog does.
  template <class Edit>
  ObjectChange change(uint32_t object, const Edit& edit) {
    ObjectChange out{object, s.caster->object_bounds(object), {}};
    edit(s.scene.objects[object]);
    s.caster->update_object(s.scene, object);
    out.after = s.caster->object_bounds(object);
    s.discs.place_parts();
    return out;
  }

  /// Calls visit(bounce, slot, segment) for every slot in use.
  template <class Visit>
  void each(const Visit& visit) const {
    const auto& bounces = s.paths.store.bounces();
    for (uint32_t bounce = 0; bounce < bounces.size(); ++bounce)
      for (uint32_t slot = 0; slot < bounces[bounce].size(); ++slot)
        if (bounces[bounce].at(slot).length >= 0) visit(bounce, slot, bounces[bounce].at(slot));
  }

  /// By path: its segments, from the light on.
  std::map<uint32_t, std::vector<Piece>> paths() const {
    std::map<uint32_t, std::vector<Piece>> out;
    const auto& bounces = s.paths.store.bounces();
    for (uint32_t slot = 0; slot < bounces[0].size(); ++slot) {
      std::vector<Piece>& own = out[bounces[0].at(slot).path];
      uint32_t next = slot;
      for (size_t bounce = 0; next != segments::kNoSlot; ++bounce) {
        const segments::Segment& it = bounces[bounce].at(next);
        if (it.length < 0) break;
        own.push_back({{it.origin.x, it.origin.y, it.origin.z},
                       it.direction,
                       it.length,
                       bounces[bounce].extended_or_length(next),
                       {it.power[0], it.power[1], it.power[2]},
                       it.path,
                       it.primitive});
        next = it.next;
      }
    }
    return out;
  }

  State s;
  Progress progress;

 private:
  static Options options_of(const Variant& variant) {
    Options out = options(variant.threads, DirectMode::automatic, variant.end);
    out.paths = variant.paths;
    out.gather_rays = variant.gathers ? 16 : 0;
    out.range = variant.range;
    return out;
  }

  void add_disc(samples::DiscSet& discs, uint32_t id) const {
    discs.centre.push_back(s.samples.point[id]);
    discs.normal.push_back(s.samples.normal[id]);
    discs.radius.push_back(s.samples.radius[id]);
    discs.outline.push_back(samples::kWholeDisc);
    discs.id.push_back(id);
  }

  void make_discs(const Variant& variant) {
    samples::DiscSet still;
    for (uint32_t i = 0; i < 64; ++i) {
      const uint32_t id = 29 * i % 64;  // discs are in another order than samples
      s.samples.radius[id] = id % 3 ? 0.15f : 0.6f;
      add_disc(still, id);
    }
    s.largest_radius = 0.6f;
    if (variant.collects)
      s.discs.still = std::make_shared<estimate::RayMapDiscs>(still, variant.end);
    else
      s.discs.still = std::make_shared<estimate::DiscIndex>(still, variant.end, Workers(1));
    for (const uint32_t object : {1u, 2u}) {
      samples::DiscSet own;
      MovingPart part;
      part.object = object, part.current = true;
      for (uint32_t id = 0; id < s.samples.size(); ++id)
        if (s.samples.attached[id] == object) {
          add_disc(own, id);
          part.local.grow(
              Box{s.samples.point[id], s.samples.point[id]}.padded(s.samples.radius[id]));
        }
      part.index = std::make_shared<estimate::DiscIndex>(own, variant.end, Workers(1));
      s.discs.place_part(part);
      s.discs.moving.push_back(std::move(part));
    }
  }

  std::vector<uint32_t> first_slots_;
};

// ---- what the store says, segment by segment ----------------------------------------------------

/// Index of the light of a path.
inline size_t slow_light_of(const State& s, uint32_t path) {
  size_t light = 0;
  while (path >= s.lights[light].first_path + s.lights[light].path_count) ++light;
  return light;
}

/// The sums that a segment's power belongs to.
inline uint32_t slow_slab_of(const State& s, uint32_t path) {
  const trace::Light& light = s.lights[slow_light_of(s, path)];
  return uint32_t(light.sums * kBatches + (path - light.first_path) * kBatches / light.path_count);
}

/// Calls visit(disc) for every disc of the part (null: the static one) that a segment crosses.
template <class Visit>
void each_crossed(const State& s, const MovingPart* part, uint32_t bounce, uint32_t slot,
                  const Visit& visit) {
  const segments::BounceSegments& stored = s.paths.store.bounces()[bounce];
  const segments::Segment& segment = stored.at(slot);
  Vec3f o = segment.origin, w = decode_direction(segment.direction);
  if (part) {
    const FastTransform to_local(s.scene.objects[part->object].pose.inverse());
    o = to_local.point(o), w = to_local.direction(w);
  }
  const samples::DiscSet& discs = (part ? part->index : s.discs.still)->discs();
  for (uint32_t k = 0; k < discs.size(); ++k)
    if (estimate::crosses(discs, k, o, w, segment.length, stored.extended_or_length(slot),
                          s.options.segment_end)
            .hit)
      visit(k);
}

/// Whether discs count segments of this bounce of a light's paths.
inline bool is_counted(const State& s, uint32_t bounce, uint32_t path) {
  return bounce == 0 ? !s.light_sampled[slow_light_of(s, path)] : !s.gathers();
}

/// Sums of all discs of all segments for which wanted(bounce, slot) is true, one by one; of moving
/// parts only if they are current, and their object present.
template <class Wanted>
std::vector<int64_t> slow_sums(const StateWorld& world, const Wanted& wanted) {
  const State& s = world.s;
  std::vector<int64_t> sums(s.discs.sums.size());
  world.each([&](uint32_t bounce, uint32_t slot, const segments::Segment& segment) {
    if (!is_counted(s, bounce, segment.path) || !wanted(bounce, slot)) return;
    const auto add = [&](const MovingPart* part) {
      const samples::DiscSet& discs = (part ? part->index : s.discs.still)->discs();
      each_crossed(s, part, bounce, slot, [&](uint32_t disc) {
        for (size_t c = 0; c < 3; ++c)
          sums[3 * (slow_slab_of(s, segment.path) * s.samples.size() + discs.id[disc]) + c] +=
              segment.power[c];
      });
    };
    add(nullptr);
    for (const MovingPart& part : s.discs.moving)
      if (part.current && s.scene.objects[part.object].present) add(&part);
  });
  return sums;
}

inline std::vector<int64_t> slow_sums(const StateWorld& world) {
  return slow_sums(world, [](uint32_t, uint32_t) { return true; });
}

}  // namespace deltalux::session
