// SPDX-License-Identifier: Apache-2.0
// Tells for each ray what its light depends on, and lets trace::ChangeTest decide.
#include "gather/hits/stale_rays.h"

#include <algorithm>
#include <limits>

namespace deltalux::gather {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

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
  find_changed_lights();
  if (!change.scene.objects.empty()) {
    landing_.resize(context.cells.size());
    context.cells.each_landing(context.scene, {}, [&](uint32_t cell, const BodyCells::Ball& ball) {
      landing_[cell] = ball;
    });
  }
  judge_cells();
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

void StaleRays::judge_cells() {
  met_.resize(context_.cells.size() + 1, none);
  for (uint32_t cell = 0; cell + 1 < met_.size(); ++cell) {
    const uint64_t reach = context_.beams.reach(cell);
    // Where a sun shines is not known of a cell.
    if (suns_ || is_own(cell) || reach & placed_) {
      met_[cell] = all;
    } else if (placed_) {
      met_[cell] = in_beams;
    } else if (reach && !landing_.empty()) {
      const Vec3f centre = landing_[cell].centre;
      if (touches_beams(Box{centre, centre}.padded(landing_[cell].radius))) met_[cell] = in_beams;
    }
  }
}

bool StaleRays::touches_beams(const Box& points) const {
  for (size_t b = 0; b < context_.beams.size(); ++b)
    if (test_.touches_light(context_.beams[b].guide().light, points)) return true;
  return false;
}

bool StaleRays::bends_shaded(uint32_t chain) const {
  Box bends;
  hits_.chains().each_bend(chain, [&](Vec3f p) { bends.grow(p); });
  return !bends.empty() && touches_beams(bends);
}

StaleRays::Around StaleRays::around(const Box& chains) const {
  Around out{true, chains.centre(), {}};
  if (chains.empty()) return out;
  out.apart = !test_.touches(chains) && !lit_by_changed(chains);
  for (uint32_t light = 0; light < context_.lights.size() && out.apart; ++light)
    out.apart = !test_.shades(light, chains);
  const Vec3f half = max(chains.high - out.from, out.from - chains.low);
  for (const Box& box : test_.boxes()) out.wider.push_back({box.low - half, box.high + half});
  return out;
}

void StaleRays::mark(const SampleRays& rays, size_t sample, const Around& around, Scratch& scratch,
                     std::vector<Stale>& again) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  const size_t first = hits_.rays().first(sample);
  scratch.chained.resize(targets.size());
  uint32_t* const chained = scratch.chained.data();
  size_t chains = 0;
  const size_t nowhere = met_.size() - 1;
  for (uint32_t ray = 0; ray < targets.size(); ++ray) {
    // No predictor could guess which rays have chains.
    const uint32_t target = targets[ray];
    chained[chains] = ray, chains += GatherHits::is_chain(target);
    const Met met = met_[std::min(size_t(target), nowhere)];
    const bool stale = met == all || (met == in_beams && hits_.in_beam(first + ray));
    again[ray] = {stale ? Stale::all : Stale::no};
  }
  scratch.chained.resize(chains);
  mark_chains(rays, sample, around, scratch, again);
  if (!change_.points.empty())
    rays.each_moved(change_.points, [&](uint32_t ray) { again[ray].what = Stale::all; });
  for (const trace::MovedObject& moved : change_.scene.objects)
    if (!moved.now.empty()) mark_hidden(rays, sample, moved, scratch, again);
}

void StaleRays::mark_chains(const SampleRays& rays, size_t sample, const Around& around,
                            Scratch& scratch, std::vector<Stale>& again) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  const size_t first = hits_.rays().first(sample);
  const ChainPool& chains = hits_.chains();
  trace::Ways& tips = scratch.tips;
  tips.clear(scratch.chained.size());
  for (const uint32_t ray : scratch.chained)
    tips.add(chains.tip(GatherHits::chain_of(targets[ray])));
  const auto mark_shadows = [&](uint32_t light) {
    for (const trace::ShadowVolume& shadow : test_.shadows_of(light)) tips.mark_within(shadow);
  };
  if (placed_ || suns_) {
    for (const uint32_t ray : scratch.chained)
      if (suns_ || hits_.in_beam(first + ray)) again[ray].what = Stale::all;
  } else if (context_.beams.size() && !landing_.empty()) {
    tips.unmark();
    for (size_t b = 0; b < context_.beams.size(); ++b)
      mark_shadows(context_.beams[b].guide().light);
    for (size_t i = 0; i < tips.size(); ++i) {
      const uint32_t ray = scratch.chained[i];
      if (!hits_.in_beam(first + ray)) continue;
      if (tips.marked(i) || (!around.apart && bends_shaded(GatherHits::chain_of(targets[ray]))))
        again[ray].what = Stale::all;
    }
  }
  // Most chains are far from what moved: do not even look at their vertices.
  tips.unmark();
  tips.mark_meeting(around.wider, around.from);
  for (const uint32_t sun : context_.suns.lights()) mark_shadows(sun);
  size_t near = 0;
  for (size_t i = 0; i < tips.size(); ++i) {
    const uint32_t ray = scratch.chained[i];
    if (again[ray].what == Stale::all || !(tips.marked(i) || !around.apart || placed_)) continue;
    scratch.chained[near++] = ray;
  }
  // Let memory bring many chains at once.
  const auto chain_at = [&](size_t i) {
    return GatherHits::chain_of(targets[scratch.chained[std::min(i, near - 1)]]);
  };
  constexpr size_t kAhead = 8;
  for (size_t i = 0; i < near; ++i) {
    chains.prefetch(chain_at(i + 2 * kAhead));
    chains.prefetch_vertices(chain_at(i + kAhead));
    const uint32_t ray = scratch.chained[i], chain = chain_at(i);
    again[ray] = gone(chain, hits_.in_beam(first + ray), around);
    if (again[ray].what != Stale::all && is_hidden(rays, ray, chain, around.apart))
      again[ray] = {Stale::all};
  }
}

bool StaleRays::is_hidden(const SampleRays& rays, uint32_t ray, uint32_t chain, bool apart) const {
  const ChainPool& chains = hits_.chains();
  // Of a chain that goes on behind its first hit, no segment but the last may meet what is apart.
  const bool goes_on = !chains.vertices(chain).front().is_of_end();
  if (apart && goes_on) return false;
  const Vec3f hit = goes_on ? chains.places(chain).front().point() : chains.tip(chain);
  return std::any_of(change_.scene.objects.begin(), change_.scene.objects.end(),
                     [&](const trace::MovedObject& moved) {
                       return trace::meets_any({&moved.now, 1}, rays.origin(), hit) &&
                              meets(rays, ray, moved);
                     });
}

bool StaleRays::meets(const SampleRays& rays, uint32_t ray, const trace::MovedObject& moved) const {
  const Vec3f origin = rays.origin(), w = rays.aim(ray).w;
  return !(w == Vec3f{}) && SlabRay(origin, w).entry(moved.now, kFar) < kFar &&
         context_.caster.closest_object(moved.object, origin, w).valid();
}

void StaleRays::mark_hidden(const SampleRays& rays, size_t sample, const trace::MovedObject& moved,
                            Scratch& scratch, std::vector<Stale>& again) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  const Vec3f centre = moved.now.centre();
  trace::Ways& landings = scratch.landings;
  landings.clear(targets.size());
  scratch.passing.resize(targets.size());
  rays.each_towards(centre, 0.5001f * moved.now.diagonal(), [&](uint32_t ray) {
    const uint32_t target = targets[ray];
    if (GatherHits::is_chain(target) || again[ray].what == Stale::all) return;
    scratch.passing[landings.size()] = ray;
    if (target == kDark)
      landings.add(centre);  // It may pass all of the object.
    else
      landings.add(landing_[target].centre, landing_[target].radius);
  });
  landings.unmark();
  landings.mark_meeting({&moved.now, 1}, rays.origin());
  for (size_t i = 0; i < landings.size(); ++i)
    if (landings.marked(i) && meets(rays, scratch.passing[i], moved))
      again[scratch.passing[i]] = {Stale::all};
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
  // The first segment is the ray, which mark() tests, but for where it ends.
  if (!around.apart && test_.touches(Box{from, from})) return {Stale::all};
  uint8_t k = 1;
  for (; k < vertices.size() && !vertices[k].is_of_end(); ++k) {
    const Vec3f to = places[k].point();
    if (!around.apart && !(to == from) && test_.touches(from, to)) return {Stale::tail, k};
    from = to;
  }
  return {test_.touches(from, hits_.chains().tip(chain)) ? Stale::tail : Stale::no, k};
}

Stale StaleRays::gone(uint32_t chain, bool in_beam, const Around& around) const {
  const std::span<const Vertex> vertices = hits_.chains().vertices(chain);
  if (vertices.front().is_of_end()) {
    const uint32_t end = hits_.chains().end(chain);
    if (is_own(end) || context_.beams.reach(end) & placed_) return {Stale::all};
  } else if (placed_) {  // Where directions go depends on all beams.
    return {Stale::all};
  } else if (Stale own = touched(chain, around); own.what != Stale::no) {
    if (in_beam || !keeps_ways_) own.what = Stale::all;
    return own;
  }
  const std::span<const Place> places = hits_.chains().places(chain);
  for (size_t k = 0; k < vertices.size(); ++k) {
    const Vertex& vertex = vertices[k];
    if (vertex.is_tint() || vertex.is_caustic()) continue;
    if (around.apart && !vertex.is_of_end()) continue;
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
