// SPDX-License-Identifier: Apache-2.0
// Short paths from receivers, with one shadow ray at each vertex.
#include "gather/chain.h"

#include <algorithm>
#include <bit>

#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::gather {
namespace {

enum : uint32_t {
  kChoice,
  kPlace,
  kTurnU,
  kTurnV,
  kStays
};  // dimensions of a vertex's random numbers

/// One of `strata`'s countable rays by its weight; nullopt where none has any.
std::optional<size_t> chosen_ray(const direct::Strata& strata, float place) {
  double all = 0;
  const auto weight = [&](size_t i) {
    return strata.countable[i / 64] >> (i % 64) & 1 ? double(strata.weight[i]) : 0.0;
  };
  for (size_t i = 0; i < strata.fan.count; ++i) all += weight(i);
  if (!(all > 0)) return std::nullopt;
  double left = double(place) * all;
  std::optional<size_t> last;
  for (size_t i = 0; i < strata.fan.count; ++i) {
    if (!(weight(i) > 0)) continue;
    last = i;
    left -= weight(i);
    if (left < 0) break;
  }
  return last;
}

}  // namespace

OneLight::OneLight(std::span<const trace::Light> lights, uint32_t groups, uint64_t seed)
    : lights_(lights), groups_(groups) {
  for (uint32_t i = 0; i < lights.size(); ++i) {
    shapes_.emplace_back();
    if (lights[i].on) shapes_.back().emplace(lights[i], i, seed);
  }
}

void OneLight::ask(const trace::RayCaster& caster, const direct::Receiver& receiver, float choice,
                   float place, Vertex& out) const {
  thread_local std::vector<double> weight, open, of_group;
  weight.assign(lights_.size(), 0), open.assign(lights_.size(), 0), of_group.assign(groups_, 0);
  double all = 0;
  for (size_t l = 0; l < lights_.size(); ++l) {
    if (!shapes_[l]) continue;
    open[l] = shapes_[l]->open(receiver);
    weight[l] = open[l] * shapes_[l]->brightest();
    of_group[lights_[l].group] += weight[l], all += weight[l];
  }
  out.light = scene::kNone, out.direct = {};
  if (!(all > 0) || !std::isfinite(all)) return;
  const double groups =
      double(std::count_if(of_group.begin(), of_group.end(), [](double w) { return w > 0; }));
  const auto chance = [&](size_t l) {
    return weight[l] > 0
               ? 0.5 * weight[l] / all + 0.5 * weight[l] / (groups * of_group[lights_[l].group])
               : 0.0;
  };
  double left = choice;
  size_t chosen = lights_.size();
  for (size_t l = 0; l < lights_.size() && left >= 0; ++l) {
    if (!(weight[l] > 0)) continue;
    chosen = l;
    left -= chance(l);
  }
  out.light = uint32_t(chosen);
  direct::Strata strata;
  shapes_[chosen]->cast(receiver, direct::Level::coarse, strata);
  const auto ray = chosen_ray(strata, place);
  if (!ray) return;
  const Vec3f d{strata.fan.x[*ray], strata.fan.y[*ray], strata.fan.z[*ray]};
  if (caster.occluded_static(strata.fan.origin, d, strata.fan.to) ||
      caster.occluded_movable(strata.fan.origin, d, strata.fan.to))
    return;
  const trace::Light& light = lights_[chosen];
  const Vec3f power = light.kind == scene::LightKind::area ? light.radiance : light.intensity;
  const double factor = open[chosen] / chance(chosen);
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
    one_light_.ask(present_.caster,
                   {at, n, scene.objects[object].movable ? object : scene::kNone, plane},
                   random(chain.count, kChoice), random(chain.count, kPlace), vertex);
    origin = trace::leave_surface(origin, w, hit, n, plane);
    w = trace::cosine_direction(n, random(chain.count, kTurnU), random(chain.count, kTurnV));
    chain.passage.origin = chain.passage.last = origin;
    ++chain.count;
    if (chain.count == kMostVertices ||
        (chain.count > kSurely && !(random(chain.count, kStays) < kGoesOn)))
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
