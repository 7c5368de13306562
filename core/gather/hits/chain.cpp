// SPDX-License-Identifier: Apache-2.0
// Traces short paths from receivers, with one shadow ray at each vertex.
#include "gather/hits/chain.h"

#include <algorithm>
#include <optional>

#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::gather {
namespace {

enum : uint32_t {
  kLightU,
  kLightV,
  kTurnU,
  kTurnV,
  kStays,
  kLobe,
  kLobeU,
  kLobeV
};  // dimensions of a vertex's random numbers

/// Adds factors, unless they change nothing.
void add_factor(Vec3f factor, const direct::Receiver& at, Chain& chain) {
  if (factor != Vec3f{1, 1, 1}) chain.add(Vertex::of_factor(factor), at);
}

/// Where a chain that came from `bend` leaves a point: a function of what is stored, so that it can
/// be resumed there.
Vec3f leave(Vec3f bend, const direct::Receiver& at) {
  const Vec3f way = at.point - bend;
  const float t = length(way);
  if (!(t > 0)) return at.point + at.normal * at.slack();
  trace::Hit hit;
  hit.t = t;
  return trace::leave_surface(bend, way * (1 / t), hit, at.normal, at.plane);
}

}  // namespace

ChainTracer::ChainTracer(const Context& context, const CellFinder& finder, const Targets& targets,
                         uint64_t seed)
    : context_(context),
      finder_(finder),
      targets_(targets),
      one_light_(
          context.lights, [](uint32_t) { return true; }, context.scene.group_count, seed),
      one_beam_(
          context.lights, [&](uint32_t light) { return context.beams.has(light); },
          context.scene.group_count, seed),
      one_sun_(
          context.lights, [&](uint32_t light) { return context.suns.has(light); },
          context.scene.group_count, seed),
      seed_(mix64(seed ^ 0x636861696e212121ull)) {}

Draw ChainTracer::light_draw(uint64_t key, uint32_t step, const Draw& first) const {
  const PathRandom random(seed_, key);
  return step ? Draw{random(step, kLightU), random(step, kLightV)} : first;
}

ChainTracer::Taken ChainTracer::take_lobe(const PathRandom& random, uint32_t step,
                                          const direct::Receiver& at, const trace::Hit& hit,
                                          Vec3f& origin, Vec3f& w, Chain& chain) const {
  const scene::Scene& scene = context_.scene;
  const scene::Material& surface = scene.material_of(hit.primitive);
  const surfaces::Arrival arrival{w, hit.normal, scene.point_on(hit.primitive, hit.u, hit.v)};
  if (random(step, kLobe) < surface.kind->diffuse_share(surface, arrival.at)) return Taken::diffuse;
  surfaces::Onward out;
  if (!surface.kind->onward(surface, arrival, random(step, kLobeU), random(step, kLobeV), out))
    return Taken::nothing;
  const float plane = scene.slack_of(hit.primitive);
  if (out.lobe == surfaces::Lobe::straight) {
    // Even if it changes nothing: the result depends on what lies here.
    chain.add(Vertex::of_factor(out.factor), at);
    origin = trace::pass_surface(origin, w, hit, plane);
    return Taken::by_factor;
  }
  if (out.painted) {
    add_factor(out.factor, at, chain);
    chain.add({scene.material_index(hit.primitive), scene::kNone, 0, chain.weight}, at);
  } else {
    chain.add(Vertex::of_factor(out.factor), at);
  }
  origin = trace::leave_surface(origin, w, hit, out.normal, plane);
  w = out.direction;
  return out.painted ? Taken::painted : Taken::by_factor;
}

Chain ChainTracer::trace(uint64_t key, const Draw& first, Vec3f origin, Vec3f w,
                         const trace::Hit& met, uint32_t cell) const {
  Chain chain;
  chain.tip = origin + w * met.t;
  Walk walk{origin, w, met, cell, origin};
  follow(key, first, walk, chain);
  return chain;
}

Chain ChainTracer::resume(uint64_t key, const Draw& first, Vec3f origin, const Points& kept) const {
  Chain chain;
  Walk walk{origin, {}, {}, kNoCell, origin};
  std::copy(kept.vertices.begin(), kept.vertices.end(), chain.vertex.begin());
  std::copy(kept.places.begin(), kept.places.end(), chain.place.begin());
  std::copy(kept.tints.begin(), kept.tints.end(), chain.tint.begin());
  chain.count = uint32_t(kept.size());
  chain.weight = kept.vertices.back().weight;
  for (size_t k = 0; k + 1 < kept.size(); ++k)
    if (kept.vertices[k].is_point()) walk.bend = kept.places[k].point(), ++walk.step;
  walk.touched = walk.step;
  if (go_on(key, first, Taken::diffuse, walk, chain)) follow(key, first, walk, chain);
  return chain;
}

void ChainTracer::follow(uint64_t key, const Draw& first, Walk& walk, Chain& chain) const {
  for (;;) {
    const trace::Hit hit = walk.hit;
    const direct::Receiver at = context_.landing(walk.origin, walk.w, hit);
    const Draw draw = light_draw(key, walk.step, first);
    const Taken taken = goes_on_at(hit) ? take_lobe(PathRandom(seed_, key), walk.step, at, hit,
                                                    walk.origin, walk.w, chain)
                                        : Taken::diffuse;
    if (taken == Taken::diffuse) {
      if (hit.t >= context_.cells.near(walk.cell)) return finish(draw, at, hit, walk.cell, chain);
      touch(draw, at, hit, walk.cell, chain);
    }
    if (!go_on(key, first, taken, walk, chain)) return;
  }
}

bool ChainTracer::go_on(uint64_t key, const Draw& first, Taken taken, Walk& walk,
                        Chain& chain) const {
  const PathRandom random(seed_, key);
  std::optional<DirectionSampler> sampler;
  Aim aim{walk.w};
  if (taken == Taken::diffuse) {
    const direct::Receiver at = chain.place[chain.count - 1].receiver();
    walk.origin = leave(walk.bend, at);
    sampler.emplace(targets_, walk.origin, at.normal);
    const Draw turn =
        walk.step ? Draw{random(walk.step, kTurnU), random(walk.step, kTurnV)} : first;
    aim = sampler->draw(turn[0], turn[1], chain.in_beam);
    walk.w = aim.w;
  }
  if (chain.count) walk.bend = chain.place[chain.count - 1].point();
  // A ray that misses the point that it aims for ends here, but follows it when it moves.
  chain.tip = aim.point ? aim.point->at : walk.origin;
  ++walk.step;
  if (walk.step == kMaxTouched || walk.w == Vec3f{} || taken == Taken::nothing) return false;
  if (taken != Taken::by_factor && ++walk.touched > kSurely &&
      !(random(walk.step, kStays) < kGoesOn))
    return false;
  const trace::Hit& hit = walk.hit = context_.caster.closest(walk.origin, walk.w);
  if (hit.valid()) context_.scene.fetch_point(hit.primitive);
  if (aim.point && !(hit.valid() && aim.point->is_met(walk.origin, walk.w, hit))) return false;
  chain.tip = walk.origin + walk.w * (hit.valid() ? hit.t : context_.scene.beyond());
  if (!hit.valid()) return false;
  if (sampler)
    chain.weight *= sampler->weight(aim, hit.t, context_.landing(walk.origin, walk.w, hit),
                                    context_.caster, chain.in_beam);
  walk.cell = finder_.find(hit.primitive, walk.origin, walk.w, hit.t);
  return walk.cell != kNoCell;
}

void ChainTracer::touch(const Draw& draw, const direct::Receiver& at, const trace::Hit& hit,
                        uint32_t cell, Chain& chain) const {
  const scene::Scene& scene = context_.scene;
  const uint32_t material = scene.material_index(hit.primitive);
  scene.fetch_tint(hit.primitive, hit.u, hit.v);  // arrives while the lamp is asked
  const OneLight::Answer answer = one_light_.ask(context_.caster, Place::of(at).receiver(), draw);
  const Tint tint = Tint::of(scene.tint_at(hit.primitive, hit.u, hit.v));
  if (scene.has_specular())
    chain.add({material | Vertex::kCaustic, cell, 1, chain.weight}, at, tint);
  chain.add({material, answer.light, answer.direct, chain.weight}, at, tint);
}

void ChainTracer::finish(const Draw& draw, const direct::Receiver& at, const trace::Hit& hit,
                         uint32_t cell, Chain& chain) const {
  chain.end = cell;
  const scene::Scene& scene = context_.scene;
  const uint32_t material = scene.material_index(hit.primitive) | Vertex::kEnd;
  const direct::Receiver receiver = Place::of(at).receiver();
  std::optional<Tint> tint;
  // Keep the vertex even if something hides the light: it may move.
  const auto ask = [&](const OneLight& one, bool keeps_dark) {
    const OneLight::Answer answer = one.ask(context_.caster, receiver, draw);
    if (answer.light == scene::kNone) return false;
    if (keeps_dark || answer.direct > 0) {
      if (!tint) tint = Tint::of(scene.tint_at(hit.primitive, hit.u, hit.v));
      chain.add({material, answer.light, answer.direct, chain.weight}, at, *tint);
    }
    return true;
  };
  if (context_.beams.reach(cell)) chain.in_beam |= ask(one_beam_, false);
  if (context_.suns.may_shine(at.normal)) ask(one_sun_, true);
}

Chain ChainTracer::end(const Draw& first, Vec3f origin, Vec3f w, const trace::Hit& hit,
                       uint32_t cell) const {
  Chain chain;
  chain.tip = origin + w * hit.t;
  finish(first, context_.landing(origin, w, hit), hit, cell, chain);
  return chain;
}

}  // namespace deltalux::gather
