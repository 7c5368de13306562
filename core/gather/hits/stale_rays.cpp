// SPDX-License-Identifier: Apache-2.0
// Tells for each ray what its light depends on, and lets trace::ChangeTest decide.
#include "gather/hits/stale_rays.h"

#include <algorithm>
#include <limits>

namespace deltalux::gather {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

/// Balls around all boxes, one for those that lie close together.
std::vector<BodyCells::Ball> balls_around(std::span<const Box> boxes) {
  constexpr float kClose = 1.25f;  // how much longer their common diagonal may be
  std::vector<Box> grown;
  for (const Box& box : boxes) {
    const auto same = std::find_if(grown.begin(), grown.end(), [&](const Box& own) {
      Box both = own;
      both.grow(box);
      return both.diagonal() <= kClose * std::max(own.diagonal(), box.diagonal());
    });
    if (same == grown.end())
      grown.push_back(box);
    else
      same->grow(box);
  }
  std::vector<BodyCells::Ball> out;
  for (const Box& box : grown) out.push_back({box.centre(), 0.5001f * box.diagonal()});
  return out;
}

bool is_in(std::span<const Box> boxes, Vec3f p) {
  return std::any_of(boxes.begin(), boxes.end(),
                     [&](const Box& box) { return box.overlaps(Box{p, p}); });
}

std::span<const Box> parts_of(const trace::MovedObject& moved) {
  if (moved.parts_now.empty()) return {&moved.now, 1};
  return moved.parts_now;
}

}  // namespace

StaleRays::StaleRays(const GatherHits& hits, const Context& context, const Change& change)
    : hits_(hits),
      context_(context),
      change_(change),
      test_(change.scene, context.lights, trace::shadow_slack(context.caster)),
      suns_(std::any_of(context.guiding.suns.begin(), context.guiding.suns.end(),
                        [&](uint32_t sun) { return change.scene.changes(sun); })),
      keeps_ways_(!context.scene.has_specular() && !context.scene.transmits()),
      placed_(context.beams.placed(change.scene)) {
  for (const trace::MovedObject& moved : change.scene.objects)
    own_.push_back(context.cells.of_object(moved.object));
  for (size_t b = 0; b < context.beams.size(); ++b)
    beam_lights_.push_back(context.beams[b].guide().light);
  find_changed_lights();
  if (!change.scene.objects.empty()) {
    landing_.resize(context.cells.size());
    context.cells.each_landing(context.scene, {}, [&](uint32_t cell, const BodyCells::Ball& ball) {
      landing_[cell] = ball;
    });
  }
  if (!placed_ && context.beams.size() && !landing_.empty()) find_shaded_beams();
  find_balls();
}

void StaleRays::find_changed_lights() {
  const std::span<const trace::Light> lights = context_.lights;
  std::vector<size_t> members;  // by group: lights with a place
  for (const trace::Light& light : lights) {
    members.resize(std::max(members.size(), size_t(light.group) + 1));
    members[light.group] += !light.is_parallel();
  }
  const auto add = [&](const trace::Light& light) {
    everywhere_ |= members[light.group] > OneLight::kMany;
    changed_.push_back(direct::shape_of(light, 0, 0));
  };
  for (uint32_t light = 0; light < lights.size(); ++light)
    if (change_.scene.changes(light)) add(lights[light]);
  for (const trace::Light& light : change_.scene.before) add(light);
  everywhere_ |= changed_.size() > trace::Change::kMaxBefore;
}

bool StaleRays::lit_by_changed(const Box& points) const {
  return everywhere_ || std::any_of(changed_.begin(), changed_.end(),
                                    [&](const auto& shape) { return shape->may_light(points); });
}

void StaleRays::find_shaded_beams() {
  in_shaded_beam_.resize(context_.cells.size(), 0);
  for (uint32_t cell = 0; cell < context_.cells.size(); ++cell) {
    if (!context_.beams.reach(cell)) continue;
    const auto& [centre, radius] = landing_[cell];
    in_shaded_beam_[cell] = touches_beams(Box{centre, centre}.padded(radius));
  }
}

void StaleRays::find_balls() {
  for (const trace::MovedObject& moved : change_.scene.objects)
    passed_.push_back(balls_around(moved.passed));
  // Where rays land is rounded.
  const Box world = context_.scene.world().padded(trace::shadow_slack(context_.caster));
  std::vector<Box> shaded;
  for (const uint32_t sun : context_.suns.lights())
    for (const trace::ShadowVolume& shadow : test_.shadows_of(sun))
      if (const Box box = shadow.bounds(world); !box.empty()) shaded.push_back(box);
  shaded_ = balls_around(shaded);
}

template <class Points>
bool StaleRays::touches_beams(const Points& points) const {
  return std::any_of(beam_lights_.begin(), beam_lights_.end(),
                     [&](uint32_t light) { return test_.touches_light(light, points); });
}

bool StaleRays::bends_shaded(uint32_t chain) const {
  Box bends;
  hits_.chains().each_bend(chain, [&](Vec3f p) { bends.grow(p); });
  return !bends.empty() && touches_beams(bends);
}

bool StaleRays::is_apart(const Box& chains) const {
  if (chains.empty()) return true;
  bool apart = !test_.touches(chains) && !lit_by_changed(chains);
  for (uint32_t light = 0; light < context_.lights.size() && apart; ++light)
    apart = !test_.shades(light, chains);
  return apart;
}

void StaleRays::look_around(const Box& chains, bool apart, Around& around) const {
  around.apart = apart || is_apart(chains);
  around.from = chains.centre();
  around.wider.clear();
  if (chains.empty()) return;
  const Vec3f half = max(chains.high - around.from, around.from - chains.low);
  for (const Box& box : test_.boxes()) around.wider.push_back({box.low - half, box.high + half});
}

void StaleRays::mark(const SampleRays& rays, size_t sample, const Around& around,
                     Scratch& scratch) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  scratch.clear(targets.size());
  if (suns_) {
    for (uint32_t ray = 0; ray < targets.size(); ++ray) scratch.mark(ray, {Stale::all});
    return;
  }
  if (placed_)
    mark_placed(sample, scratch);
  else if (context_.beams.size() && !landing_.empty())
    mark_in_beams(sample, around, scratch);
  mark_bent(rays, sample, around, scratch);
  if (!change_.points.empty())
    rays.each_moved(change_.points, [&](uint32_t ray) { scratch.mark(ray, {Stale::all}); });
  for (size_t i = 0; i < change_.scene.objects.size(); ++i)
    for (const Ball& ball : passed_[i])
      mark_met(rays, sample, change_.scene.objects[i], ball, scratch);
  for (const Ball& ball : shaded_) mark_shaded(rays, sample, ball, scratch);
}

void StaleRays::mark_placed(size_t sample, Scratch& scratch) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  const size_t first = hits_.rays().first(sample);
  for (uint32_t ray = 0; ray < targets.size(); ++ray) {
    const uint32_t target = targets[ray];
    // Where the directions of a chain go depends on all beams.
    bool stale = hits_.in_beam(first + ray) || GatherHits::goes_on(target);
    if (!stale && target != kDark) stale = context_.beams.reach(hits_.end_of(target)) & placed_;
    if (stale) scratch.mark(ray, {Stale::all});
  }
}

void StaleRays::mark_in_beams(size_t sample, const Around& around, Scratch& scratch) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  scratch.which_.clear();
  hits_.each_in_beam(sample, [&](uint32_t ray) {
    const uint32_t target = targets[ray];
    if (GatherHits::is_chain(target))
      scratch.which_.push_back(ray);
    else if (target != kDark && in_shaded_beam_[target])
      scratch.mark(ray, {Stale::all});
  });
  trace::Ways& tips = scratch.ways_;
  find_tips(scratch.which_, sample, tips);
  mark_shadows(beam_lights_, tips);
  for (size_t i = 0; i < tips.size(); ++i) {
    const uint32_t ray = scratch.which_[i], target = targets[ray];
    if ((tips.marked(i) && touches_beams(tips.end(i))) ||
        (!around.apart && GatherHits::goes_on(target) &&
         bends_shaded(GatherHits::chain_of(target))))
      scratch.mark(ray, {Stale::all});
  }
}

void StaleRays::find_tips(std::span<const uint32_t> which, size_t sample, trace::Ways& tips) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  tips.clear(which.size());
  for (const uint32_t ray : which) tips.add(hits_.chains().tip(GatherHits::chain_of(targets[ray])));
  tips.unmark();
}

void StaleRays::mark_shadows(std::span<const uint32_t> lights, trace::Ways& tips) const {
  for (const uint32_t light : lights)
    for (const trace::ShadowVolume& shadow : test_.shadows_of(light)) tips.mark_within(shadow);
}

void StaleRays::mark_bent(const SampleRays& rays, size_t sample, const Around& around,
                          Scratch& scratch) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  const size_t first = hits_.rays().first(sample);
  std::vector<uint32_t>& which = scratch.which_;
  which.resize(targets.size() + 1);
  size_t count = 0;
  for (uint32_t ray = 0; ray < targets.size(); ++ray) {
    // No predictor could guess which rays go on.
    which[count] = ray;
    count += GatherHits::goes_on(targets[ray]);
  }
  which.resize(count);
  trace::Ways& tips = scratch.ways_;
  find_tips(which, sample, tips);
  // Most chains are far from what moved: do not even look at their vertices.
  tips.mark_meeting(around.wider, around.from);
  mark_shadows(context_.suns.lights(), tips);
  size_t near = 0;
  for (size_t i = 0; i < tips.size(); ++i)
    if (!scratch.casts(which[i]) && (tips.marked(i) || !around.apart)) which[near++] = which[i];
  const auto chain_at = [&](size_t i) {
    return GatherHits::chain_of(targets[which[std::min(i, near - 1)]]);
  };
  const ChainPool& chains = hits_.chains();
  constexpr size_t kAhead = 8;  // Let memory bring many chains at once.
  for (size_t i = 0; i < near; ++i) {
    chains.prefetch(chain_at(i + 2 * kAhead));
    chains.prefetch_vertices(chain_at(i + kAhead));
    const uint32_t ray = which[i], chain = chain_at(i);
    Stale own = bent(chain, hits_.in_beam(first + ray), around);
    // No segment but the last may meet what is apart.
    if (own.what != Stale::all && !around.apart) {
      const Vec3f hit = chains.places(chain).front().point();
      for (const trace::MovedObject& moved : change_.scene.objects)
        if (hides(moved, rays, ray, hit)) own = {Stale::all};
    }
    scratch.mark(ray, own);
  }
}

void StaleRays::mark_met(const SampleRays& rays, size_t sample, const trace::MovedObject& moved,
                         const Ball& ball, Scratch& scratch) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  std::vector<uint32_t>& which = scratch.which_;
  trace::Ways& landings = scratch.ways_;
  which.clear();
  rays.each_towards(ball.centre, ball.radius, [&](uint32_t ray) {
    const uint32_t target = targets[ray];
    if (GatherHits::goes_on(target) || scratch.casts(ray)) return;
    if (is_own(target)) return scratch.mark(ray, {Stale::all});
    if (moved.now.empty() && !GatherHits::is_chain(target)) return;  // nothing hides it
    // Let memory bring all of them at once.
    if (GatherHits::is_chain(target))
      hits_.chains().prefetch_tip(GatherHits::chain_of(target));
    else if (target != kDark)
      __builtin_prefetch(&landing_[target]);
    which.push_back(ray);
  });
  landings.clear(which.size());
  for (const uint32_t ray : which) {
    const uint32_t target = targets[ray];
    if (GatherHits::is_chain(target))
      landings.add(hits_.chains().tip(GatherHits::chain_of(target)));
    else if (target == kDark)
      landings.add(moved.now.centre());  // It may pass all of the object.
    else
      landings.add(landing_[target].centre, landing_[target].radius);
  }
  landings.unmark();
  landings.mark_meeting(moved.passed, rays.origin());
  for (size_t i = 0; i < landings.size(); ++i) {
    if (!landings.marked(i)) continue;
    const uint32_t ray = which[i], target = targets[ray];
    const Vec3f end = landings.end(i);
    const bool stale = GatherHits::is_chain(target)
                           ? (is_in(moved.passed, end) && is_own(hits_.end_of(target))) ||
                                 hides(moved, rays, ray, end)
                           : meets(moved, rays, ray);
    if (stale) scratch.mark(ray, {Stale::all});
  }
}

void StaleRays::mark_shaded(const SampleRays& rays, size_t sample, const Ball& ball,
                            Scratch& scratch) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  std::vector<uint32_t>& which = scratch.which_;
  which.clear();
  rays.each_towards(ball.centre, ball.radius, [&](uint32_t ray) {
    if (GatherHits::is_straight(targets[ray]) && !scratch.casts(ray)) which.push_back(ray);
  });
  find_tips(which, sample, scratch.ways_);
  mark_shadows(context_.suns.lights(), scratch.ways_);
  for (size_t i = 0; i < which.size(); ++i)
    if (scratch.ways_.marked(i))
      scratch.mark(which[i], asking(GatherHits::chain_of(targets[which[i]]), true));
}

bool StaleRays::hides(const trace::MovedObject& moved, const SampleRays& rays, uint32_t ray,
                      Vec3f hit) const {
  const std::span<const Box> parts = parts_of(moved);
  return trace::meets_any({&moved.now, 1}, rays.origin(), hit) &&
         trace::meets_any(parts, rays.origin(), hit) && meets(moved, rays, ray);
}

bool StaleRays::meets(const trace::MovedObject& moved, const SampleRays& rays, uint32_t ray) const {
  if (moved.now.empty()) return false;
  const Vec3f origin = rays.origin(), w = rays.aim(ray).w;
  if (w == Vec3f{}) return false;
  const SlabRay slabs(origin, w);
  const auto enters = [&](const Box& box) { return slabs.entry(box, kFar) < kFar; };
  const std::span<const Box> parts = parts_of(moved);
  return enters(moved.now) && std::any_of(parts.begin(), parts.end(), enters) &&
         context_.caster.closest_object(moved.object, origin, w).valid();
}

bool StaleRays::is_own(uint32_t cell) const {
  for (const auto& [first, end] : own_)
    if (cell >= first && cell < end) return true;
  return false;
}

Stale StaleRays::touched(uint32_t chain, const Around& around) const {
  const std::span<const Vertex> vertices = hits_.chains().vertices(chain);
  const std::span<const Place> places = hits_.chains().places(chain);
  Vec3f from = places.front().point();
  // The first segment is the ray, which mark_bent() tests, but for where it ends.
  if (!around.apart && test_.touches(Box{from, from})) return {Stale::all};
  uint8_t k = 1;
  for (; k < vertices.size() && !vertices[k].is_of_end(); ++k) {
    const Vec3f to = places[k].point();
    if (!around.apart && !(to == from) && test_.touches(from, to)) return {Stale::tail, k};
    from = to;
  }
  return {test_.touches(from, hits_.chains().tip(chain)) ? Stale::tail : Stale::no, k};
}

Stale StaleRays::bent(uint32_t chain, bool in_beam, const Around& around) const {
  Stale own = touched(chain, around);
  if (own.what == Stale::no) return asking(chain, around.apart);
  if (in_beam || !keeps_ways_) own.what = Stale::all;
  return own;
}

Stale StaleRays::asking(uint32_t chain, bool apart) const {
  const std::span<const Vertex> vertices = hits_.chains().vertices(chain);
  const std::span<const Place> places = hits_.chains().places(chain);
  for (size_t k = 0; k < vertices.size(); ++k) {
    const Vertex& vertex = vertices[k];
    if (vertex.is_factor() || vertex.is_caustic()) continue;
    if (apart && !vertex.is_of_end()) continue;
    if (renewal(vertex, places[k].receiver()) != Renewal::none)
      return {keeps_ways_ ? Stale::lights : Stale::all};
  }
  return {};
}

Renewal StaleRays::renewal(const Vertex& vertex, const direct::Receiver& at) const {
  const uint32_t lamp = vertex.lamp();
  if (change_.scene.changes(lamp)) return Renewal::light;
  const bool shaded = lamp != scene::kNone && test_.shades(lamp, at.point);
  // Only beams and suns are asked at ends, and where one of these changed, rays are cast again.
  if (!vertex.is_of_end() &&
      (everywhere_ || std::any_of(changed_.begin(), changed_.end(),
                                  [&](const auto& own) { return own->about(at) > 0; })))
    return shaded ? Renewal::light : Renewal::chances;
  return shaded ? Renewal::shadow : Renewal::none;
}

}  // namespace deltalux::gather
