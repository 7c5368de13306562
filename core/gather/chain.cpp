// SPDX-License-Identifier: Apache-2.0
// Short paths from receivers, with one shadow ray at each vertex.
#include "gather/chain.h"

#include <algorithm>

#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::gather {
namespace {

enum : uint32_t {
  kLight,
  kPlaceU,
  kPlaceV,
  kTurn,
  kTurnU,
  kTurnV,
  kStays
};  // dimensions of a vertex's random numbers

/// As LightShape::glance beside a light, where points drawn evenly differ much: the exact
/// irradiance, and one of many rays by its share of it.
direct::LightShape::Glance close_glance(const direct::LightShape& shape,
                                        const direct::Receiver& receiver, float place) {
  direct::Strata strata;
  shape.cast(receiver, direct::Level::coarse, strata);
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

OneLight::OneLight(std::span<const trace::Light> lights, uint32_t groups, uint64_t seed)
    : lights_(lights), groups_(groups) {
  for (uint32_t i = 0; i < lights.size(); ++i) {
    shapes_.emplace_back();
    if (lights[i].on) shapes_.back().emplace(lights[i], i, seed);
  }
}

void OneLight::ask(const trace::RayCaster& caster, const direct::Receiver& receiver,
                   const Draw& draw, Vertex& out) const {
  thread_local std::vector<double> weight, of_group;
  weight.assign(lights_.size(), 0), of_group.assign(groups_, 0);
  double all = 0;
  for (size_t l = 0; l < lights_.size(); ++l) {
    if (!shapes_[l]) continue;
    weight[l] = shapes_[l]->about(receiver) * shapes_[l]->brightest();
    of_group[lights_[l].group] += weight[l], all += weight[l];
  }
  out.light = scene::kNone, out.direct = {};
  if (!(all > 0) || !std::isfinite(all)) return;
  const double groups =
      double(std::count_if(of_group.begin(), of_group.end(), [](double w) { return w > 0; }));
  const auto chance = [&](size_t l) {
    return 0.5 * weight[l] / all + 0.5 * weight[l] / (groups * of_group[lights_[l].group]);
  };
  double left = draw.light;
  size_t chosen = lights_.size();
  for (size_t l = 0; l < lights_.size() && left >= 0; ++l) {
    if (!(weight[l] > 0)) continue;
    chosen = l;
    left -= chance(l);
  }
  out.light = uint32_t(chosen);
  const direct::LightShape::Glance ray = shapes_[chosen]->is_small(receiver)
                                             ? shapes_[chosen]->glance(receiver, draw.u, draw.v)
                                             : close_glance(*shapes_[chosen], receiver, draw.u);
  if (!(ray.irradiance > 0) || caster.occluded_static(ray.origin, ray.direction, ray.to) ||
      caster.occluded_movable(ray.origin, ray.direction, ray.to))
    return;
  const trace::Light& light = lights_[chosen];
  const Vec3f power = light.kind == scene::LightKind::area ? light.radiance : light.intensity;
  const double factor = ray.irradiance / chance(chosen);
  for (int c = 0; c < 3; ++c) out.direct[size_t(c)] = float(double(power[c]) * factor);
}

ChainTracer::ChainTracer(const Present& present, const CellFinder& finder, uint64_t seed)
    : present_(present),
      finder_(finder),
      one_light_(present.lights, present.scene.group_count, seed),
      seed_(mix64(seed ^ 0x636861696e212121ull)) {}

Chain ChainTracer::trace(uint64_t key, Vec3f origin, Vec3f w, const trace::Hit& first) const {
  const scene::Scene& scene = present_.scene;
  const PathRandom random(seed_, key);
  const float beyond = 2 * scene.world().diagonal();
  Chain chain;
  chain.passage.near.grow(origin);
  trace::Hit hit = first;
  for (;;) {
    Vertex& vertex = chain.vertex[chain.count];
    const Vec3f n = trace::facing_normal(hit, w), at = origin + w * hit.t;
    const float plane = scene.slack_of(hit.primitive);
    const uint32_t object = scene.object_of(hit.primitive);
    chain.passage.near.grow(at);
    vertex.material = scene.material_index(hit.primitive);
    one_light_.ask(
        present_.caster, {at, n, scene.objects[object].movable ? object : scene::kNone, plane},
        {random(chain.count, kLight), random(chain.count, kPlaceU), random(chain.count, kPlaceV)},
        vertex);
    for (float& value : vertex.direct) value *= chain.weight;
    origin = trace::leave_surface(origin, w, hit, n, plane);
    const DrawnDirection next =
        draw_direction(present_.guiding.guides, origin, n, random(chain.count, kTurn),
                       random(chain.count, kTurnU), random(chain.count, kTurnV));
    w = next.w, chain.weight *= next.weight;
    chain.passage.origin = chain.passage.last = origin;
    ++chain.count;
    if (chain.count == kMostVertices ||
        (chain.count > kSurely && !(random(chain.count, kStays) < kGoesOn)) || w == Vec3f{})
      return chain;
    hit = present_.caster.closest(origin, w);
    chain.passage.last = origin + w * (hit.valid() ? hit.t : beyond);
    if (!hit.valid()) return chain;
    const uint32_t cell = finder_.find(hit.primitive, origin, w, hit.t);
    if (cell == kNoCell) return chain;
    if (hit.t >= present_.cells.near(cell)) {
      chain.end = cell;
      return chain;
    }
  }
}

}  // namespace deltalux::gather
