// SPDX-License-Identifier: Apache-2.0
// Traces short paths from receivers, with one shadow ray at each vertex.
#include "gather/chain.h"

#include <algorithm>

#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::gather {
namespace {

enum : uint32_t {
  kLightU,
  kLightV,
  kTurnU,
  kTurnV,
  kStays
};  // dimensions of a vertex's random numbers

constexpr Vec3f kMaxShare{Vertex::kMaxShare, Vertex::kMaxShare, Vertex::kMaxShare};

/// Replaces LightShape::glance close to a light, where points drawn uniformly differ much in
/// contribution: returns the exact unshadowed irradiance, and one of many shadow rays, chosen by
/// its share of it.
direct::LightShape::Glance close_glance(const direct::LightShape& shape,
                                        const direct::Receiver& receiver, float place) {
  direct::Strata strata;
  shape.cast(receiver, direct::Detail::coarse, strata);
  double all = 0;
  const auto weight = [&](size_t i) {
    return strata.countable[i / 64] >> (i % 64) & 1 ? double(strata.weight[i]) : 0.0;
  };
  for (size_t i = 0; i < strata.fan.count; ++i) all += weight(i);
  if (!(all > 0)) return {};
  double left = double(place) * all;
  size_t chosen = 0;
  for (size_t i = 0; i < strata.fan.count; ++i) {
    if (!(weight(i) > 0)) continue;
    chosen = i;
    left -= weight(i);
    if (left < 0) break;
  }
  return {strata.fan.origin,
          {strata.fan.x[chosen], strata.fan.y[chosen], strata.fan.z[chosen]},
          strata.fan.to,
          shape.open(receiver)};
}

}  // namespace

OneLight::OneLight(std::span<const trace::Light> lights,
                   const std::function<bool(uint32_t)>& takes_part, uint32_t groups, uint64_t seed)
    : lights_(lights), groups_(groups) {
  for (uint32_t i = 0; i < lights.size(); ++i) {
    shapes_.emplace_back();
    if (lights[i].on && takes_part(i)) shapes_.back().emplace(lights[i], i, seed);
  }
}

void OneLight::ask(const trace::RayCaster& caster, const direct::Receiver& receiver,
                   const Draw& draw, Vertex& out) const {
  thread_local std::vector<double> weight, of_group;
  weight.assign(lights_.size(), 0), of_group.assign(groups_, 0);
  const auto hidden = [&](size_t l) {
    const direct::LightShape::Glance ray = shapes_[l]->glance(receiver, 0, 0);
    return caster.occluded_static(ray.origin, ray.direction, ray.to);
  };
  double all = 0;
  for (size_t l = 0; l < lights_.size(); ++l) {
    if (!shapes_[l]) continue;
    weight[l] = shapes_[l]->about(receiver) * shapes_[l]->brightest();
    if (weight[l] > 0 && lights_[l].is_parallel() && hidden(l)) weight[l] = 0;
    of_group[lights_[l].group] += weight[l], all += weight[l];
  }
  out.light = scene::kNone, out.direct = {};
  if (!(all > 0) || !std::isfinite(all)) return;
  const double groups =
      double(std::count_if(of_group.begin(), of_group.end(), [](double w) { return w > 0; }));
  const auto chance = [&](size_t l) {
    return 0.5 * weight[l] / all + 0.5 * weight[l] / (groups * of_group[lights_[l].group]);
  };
  double left = double(draw[0]);
  size_t chosen = lights_.size();
  for (size_t l = 0; l < lights_.size() && left >= 0; ++l) {
    if (!(weight[l] > 0)) continue;
    chosen = l;
    left -= chance(l);
  }
  out.light = uint32_t(chosen);
  // Reuse the random number of the choice: rescaled within its interval, it is uniform again.
  const float u = float(std::clamp((left + chance(chosen)) / chance(chosen), 0.0, 1 - 0x1p-24));
  const direct::LightShape::Glance ray = shapes_[chosen]->is_small(receiver)
                                             ? shapes_[chosen]->glance(receiver, u, draw[1])
                                             : close_glance(*shapes_[chosen], receiver, u);
  if (!(ray.irradiance > 0) || caster.occluded(ray.origin, ray.direction, ray.to)) return;
  const trace::Light& light = lights_[chosen];
  const Vec3f power = light.strength();
  const double factor = ray.irradiance / chance(chosen);
  for (int c = 0; c < 3; ++c) out.direct[size_t(c)] = float(double(power[c]) * factor);
}

ChainTracer::ChainTracer(const Present& present, const CellFinder& finder, uint64_t seed)
    : present_(present),
      finder_(finder),
      guides_(present.guiding.guides),
      one_light_(
          present.lights, [](uint32_t) { return true; }, present.scene.group_count, seed),
      one_beam_(
          present.lights, [&](uint32_t light) { return present.beams.has(light); },
          present.scene.group_count, seed),
      one_sun_(
          present.lights, [&](uint32_t light) { return present.suns.has(light); },
          present.scene.group_count, seed),
      seed_(mix64(seed ^ 0x636861696e212121ull)) {}

Chain ChainTracer::trace(uint64_t key, const Draw& first, Vec3f origin, Vec3f w,
                         const trace::Hit& met) const {
  const scene::Scene& scene = present_.scene;
  const PathRandom random(seed_, key);
  const float beyond = scene.beyond();
  Chain chain;
  chain.passage.near.grow(origin);
  trace::Hit hit = met;
  Vec3f share{1, 1, 1};  // product over the vertices
  for (;;) {
    Vertex& vertex = chain.vertex[chain.count];
    const direct::Receiver at = present_.landing(origin, w, hit);
    chain.passage.near.grow(at.point);
    vertex.material = scene.material_index(hit.primitive);
    const auto draw = [&](uint32_t u, uint32_t v) {
      return chain.count ? Draw{random(chain.count, u), random(chain.count, v)} : first;
    };
    one_light_.ask(present_.caster, at, draw(kLightU, kLightV), vertex);
    share = min(surfaces::product(share, scene.share_at(hit.primitive, hit.u, hit.v)), kMaxShare);
    for (size_t c = 0; c < 3; ++c) vertex.direct[c] *= chain.weight * share[int(c)];
    origin = trace::leave_surface(origin, w, hit, at.normal, at.plane);
    const Turn turn(guides_, present_.beams, origin, at.normal);
    const Draw turned = draw(kTurnU, kTurnV);
    const Aim aim = turn.draw(turned[0], turned[1], chain.in_beam);
    w = aim.w;
    // A ray that misses the point that it aims for ends here, but follows it when it moves.
    chain.passage.origin = origin;
    chain.passage.last = aim.point ? aim.point->at : origin;
    ++chain.count;
    if (chain.count == kMaxTouched ||
        (chain.count > kSurely && !(random(chain.count, kStays) < kGoesOn)) || w == Vec3f{})
      return chain;
    hit = present_.caster.closest(origin, w);
    if (aim.point && !(hit.valid() && aim.point->is_met(origin, w, hit))) return chain;
    chain.passage.last = origin + w * (hit.valid() ? hit.t : beyond);
    if (!hit.valid()) return chain;
    const direct::Receiver next = present_.landing(origin, w, hit);
    chain.weight *= turn.weight(aim, hit.t, next, present_.caster, chain.in_beam);
    const uint32_t cell = finder_.find(hit.primitive, origin, w, hit.t);
    if (cell == kNoCell) return chain;
    if (hit.t >= present_.cells.near(cell)) {
      finish(draw(kLightU, kLightV), next, hit, cell, share, chain);
      return chain;
    }
  }
}

void ChainTracer::finish(const Draw& draw, const direct::Receiver& at, const trace::Hit& hit,
                         uint32_t cell, Vec3f share, Chain& chain) const {
  chain.end = cell;
  if (share != Vec3f{1, 1, 1})
    chain.vertex[chain.count++] = {Vertex::kShare, scene::kNone, {share.x, share.y, share.z}};
  const scene::Scene& scene = present_.scene;
  const Vec3f own = scene.share_at(hit.primitive, hit.u, hit.v);
  // Keep the vertex even if something hides the light: it may move.
  const auto ask = [&](const OneLight& one) {
    Vertex& vertex = chain.vertex[chain.count];
    one.ask(present_.caster, at, draw, vertex);
    return vertex.light != scene::kNone;
  };
  const auto keep = [&] {
    Vertex& vertex = chain.vertex[chain.count++];
    vertex.material = scene.material_index(hit.primitive) | Vertex::kEnd;
    for (size_t c = 0; c < 3; ++c) vertex.direct[c] *= chain.weight * own[int(c)];
  };
  if (present_.beams.reach(cell) && ask(one_beam_)) {
    chain.in_beam = true;
    if (chain.vertex[chain.count].direct != std::array<float, 3>{}) keep();
  }
  if (present_.suns.may_shine(at.normal) && ask(one_sun_)) keep();
}

Chain ChainTracer::end(const Draw& first, Vec3f origin, Vec3f w, const trace::Hit& hit,
                       uint32_t cell) const {
  Chain chain;
  chain.passage.near.grow(origin);
  chain.passage.origin = origin, chain.passage.last = origin + w * hit.t;
  finish(first, present_.landing(origin, w, hit), hit, cell, {1, 1, 1}, chain);
  return chain;
}

}  // namespace deltalux::gather
