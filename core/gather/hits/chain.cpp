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

constexpr Vec3f kMaxTint{Vertex::kMaxTint, Vertex::kMaxTint, Vertex::kMaxTint};

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

ChainTracer::Taken ChainTracer::take_lobe(const PathRandom& random, uint32_t step,
                                          const trace::Hit& hit, Vec3f& origin, Vec3f& w,
                                          Vec3f& tint, Chain& chain) const {
  const scene::Scene& scene = context_.scene;
  const scene::Material& surface = scene.material_of(hit.primitive);
  const surfaces::Arrival arrival{w, hit.normal, scene.point_on(hit.primitive, hit.u, hit.v)};
  const float chance = surface.kind->onward_chance(surface, arrival);
  if (!(random(step, kLobe) < chance)) {
    tint = min(tint * (1 / (1 - chance)), kMaxTint);
    return Taken::diffuse;
  }
  surfaces::Onward out;
  if (!surface.kind->onward(surface, arrival, random(step, kLobeU), random(step, kLobeV), out))
    return Taken::nothing;
  tint = min(surfaces::product(tint, out.factor), kMaxTint);
  const float plane = scene.slack_of(hit.primitive);
  if (out.lobe == surfaces::Lobe::straight) {
    origin = trace::pass_surface(origin, w, hit, plane);
    return Taken::straight;
  }
  chain.vertex[chain.count++] = {scene.material_index(hit.primitive), scene::kNone, {}};
  origin = trace::leave_surface(origin, w, hit, out.normal, plane);
  w = out.direction;
  return Taken::specular;
}

Chain ChainTracer::trace(uint64_t key, const Draw& first, Vec3f origin, Vec3f w,
                         const trace::Hit& met, uint32_t cell) const {
  const scene::Scene& scene = context_.scene;
  const PathRandom random(seed_, key);
  const float beyond = scene.beyond();
  Chain chain;
  chain.footprint.near.grow(origin);
  chain.footprint.from = origin, chain.footprint.to = origin + w * met.t;
  trace::Hit hit = met;
  Vec3f tint{1, 1, 1};   // product over the vertices
  uint32_t touched = 0;  // points that are vertices
  for (uint32_t step = 0;;) {
    const auto draw = [&](uint32_t u, uint32_t v) {
      return step ? Draw{random(step, u), random(step, v)} : first;
    };
    const direct::Receiver at = context_.landing(origin, w, hit);
    const Taken taken =
        goes_on_at(hit) ? take_lobe(random, step, hit, origin, w, tint, chain) : Taken::diffuse;
    if (taken == Taken::diffuse && hit.t >= context_.cells.near(cell)) {
      finish(draw(kLightU, kLightV), at, hit, cell, tint, chain);
      return chain;
    }
    chain.footprint.near.grow(at.point);
    std::optional<DirectionSampler> sampler;
    Aim aim{w};
    if (taken == Taken::diffuse) {
      tint = min(surfaces::product(tint, scene.tint_at(hit.primitive, hit.u, hit.v)), kMaxTint);
      touch(draw(kLightU, kLightV), at, hit, cell, tint, chain);
      origin = trace::leave_surface(origin, w, hit, at.normal, at.plane);
      sampler.emplace(targets_, origin, at.normal);
      const Draw turned = draw(kTurnU, kTurnV);
      aim = sampler->draw(turned[0], turned[1], chain.in_beam);
      w = aim.w;
    }
    // A ray that misses the point that it aims for ends here, but follows it when it moves.
    chain.footprint.from = origin;
    chain.footprint.to = aim.point ? aim.point->at : origin;
    ++step;
    if (step == kMaxTouched || w == Vec3f{} || taken == Taken::nothing) return chain;
    if (taken != Taken::straight && ++touched > kSurely && !(random(step, kStays) < kGoesOn))
      return chain;
    hit = context_.caster.closest(origin, w);
    if (aim.point && !(hit.valid() && aim.point->is_met(origin, w, hit))) return chain;
    chain.footprint.to = origin + w * (hit.valid() ? hit.t : beyond);
    if (!hit.valid()) return chain;
    if (sampler)
      chain.weight *= sampler->weight(aim, hit.t, context_.landing(origin, w, hit), context_.caster,
                                      chain.in_beam);
    cell = finder_.find(hit.primitive, origin, w, hit.t);
    if (cell == kNoCell) return chain;
  }
}

void ChainTracer::touch(const Draw& draw, const direct::Receiver& at, const trace::Hit& hit,
                        uint32_t cell, Vec3f tint, Chain& chain) const {
  const scene::Scene& scene = context_.scene;
  const uint32_t material = scene.material_index(hit.primitive);
  const std::array<float, 3> factor{chain.weight * tint.x, chain.weight * tint.y,
                                    chain.weight * tint.z};
  if (scene.has_specular())
    chain.vertex[chain.count++] = {material | Vertex::kCaustic, cell, factor};
  Vertex& vertex = chain.vertex[chain.count++];
  vertex.material = material;
  one_light_.ask(context_.caster, at, draw, vertex);
  for (size_t c = 0; c < 3; ++c) vertex.direct[c] *= factor[c];
}

void ChainTracer::finish(const Draw& draw, const direct::Receiver& at, const trace::Hit& hit,
                         uint32_t cell, Vec3f tint, Chain& chain) const {
  chain.end = cell;
  if (tint != Vec3f{1, 1, 1})
    chain.vertex[chain.count++] = {Vertex::kTint, scene::kNone, {tint.x, tint.y, tint.z}};
  const scene::Scene& scene = context_.scene;
  const Vec3f own = scene.tint_at(hit.primitive, hit.u, hit.v);
  // Keep the vertex even if something hides the light: it may move.
  const auto ask = [&](const OneLight& one) {
    Vertex& vertex = chain.vertex[chain.count];
    one.ask(context_.caster, at, draw, vertex);
    return vertex.light != scene::kNone;
  };
  const auto keep = [&] {
    Vertex& vertex = chain.vertex[chain.count++];
    vertex.material = scene.material_index(hit.primitive) | Vertex::kEnd;
    for (size_t c = 0; c < 3; ++c) vertex.direct[c] *= chain.weight * own[int(c)];
  };
  if (context_.beams.reach(cell) && ask(one_beam_)) {
    chain.in_beam = true;
    if (chain.vertex[chain.count].direct != std::array<float, 3>{}) keep();
  }
  if (context_.suns.may_shine(at.normal) && ask(one_sun_)) keep();
}

Chain ChainTracer::end(const Draw& first, Vec3f origin, Vec3f w, const trace::Hit& hit,
                       uint32_t cell) const {
  Chain chain;
  chain.footprint.near.grow(origin);
  chain.footprint.from = origin, chain.footprint.to = origin + w * hit.t;
  finish(first, context_.landing(origin, w, hit), hit, cell, {1, 1, 1}, chain);
  return chain;
}

}  // namespace deltalux::gather
