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
      placed_(context.beams.placed(change.scene)) {
  for (const trace::MovedObject& moved : change.scene.objects)
    own_.push_back(context.cells.of_object(moved.object));
  find_changed_lights();
  same_lamps_ = changed_.empty() && context.beams.size() == 0 && context.suns.lights().empty();
  if (context.beams.size() && !placed_) shade_beams();
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

void StaleRays::shade_beams() {
  shaded_.resize(context_.cells.size());
  context_.cells.each_landing(context_.scene, {}, [&](uint32_t cell, const BodyCells::Ball& ball) {
    if (!context_.beams.reach(cell)) return;
    const Box point{ball.centre, ball.centre};
    shaded_[cell] = touches_beams(point.padded(ball.radius));
  });
}

bool StaleRays::touches_beams(const Box& points) const {
  for (size_t b = 0; b < context_.beams.size(); ++b)
    if (test_.touches_light(context_.beams[b].guide().light, points)) return true;
  return false;
}

bool StaleRays::shaded(uint32_t target) const {
  if (placed_) return true;
  if (!GatherHits::is_chain(target)) return shaded_[target];
  const trace::Footprint& own = hits_.chains().footprint(GatherHits::chain_of(target));
  return touches_beams(own.near) || touches_beams({own.to, own.to});
}

bool StaleRays::passes_by(const Box& chains) const {
  if (chains.empty()) return true;
  if (test_.touches(chains)) return false;
  for (uint32_t light = 0; light < context_.lights.size(); ++light)
    if (test_.touches_light(light, chains)) return false;
  return true;
}

void StaleRays::mark(const SampleRays& rays, size_t sample, bool apart,
                     std::vector<uint8_t>& again) const {
  const std::span<const uint32_t> targets = hits_.targets(sample);
  const size_t first = hits_.rays().first(sample);
  for (size_t ray = 0; ray < targets.size(); ++ray) again[ray] = gone(targets[ray], apart);
  for (size_t ray = 0; ray < targets.size() && context_.beams.size(); ++ray)
    again[ray] = again[ray] || (hits_.in_beam(first + ray) && shaded(targets[ray]));
  if (!change_.points.empty())
    rays.each_moved(change_.points, [&](uint32_t ray) { again[ray] = 1; });
  for (const trace::MovedObject& moved : change_.scene.objects) {
    if (moved.now.empty()) continue;
    rays.each_towards(moved.now.centre(), 0.5001f * moved.now.diagonal(), [&](uint32_t ray) {
      if (again[ray] || !may_be_hidden(targets[ray])) return;
      const Vec3f w = rays.aim(ray).w;
      again[ray] = !(w == Vec3f{}) && SlabRay(rays.origin(), w).entry(moved.now, kFar) < kFar &&
                   context_.caster.closest_object(moved.object, rays.origin(), w).valid();
    });
  }
}

bool StaleRays::may_be_hidden(uint32_t target) const {
  if (!GatherHits::is_chain(target)) return true;
  const trace::Footprint& own = hits_.chains().footprint(GatherHits::chain_of(target));
  return test_.touches(own.from, own.to) || test_.touches(own.near);
}

bool StaleRays::gone(uint32_t target, bool apart) const {
  if (target == kDark) return false;
  // Where a sun shines is not known of a cell.
  if (suns_) return true;
  if (GatherHits::is_chain(target)) return touches(GatherHits::chain_of(target), apart);
  return is_own(target) || context_.beams.reach(target) & placed_;
}

bool StaleRays::is_own(uint32_t cell) const {
  for (const auto& [first, end] : own_)
    if (cell >= first && cell < end) return true;
  return false;
}

bool StaleRays::touches(uint32_t chain, bool apart) const {
  const trace::Footprint& own = hits_.chains().footprint(chain);
  // Most chains are far from what moved: do not even look at their vertices.
  if (apart && same_lamps_ && !test_.touches(own.from, own.to) && !test_.touches(own.near))
    return false;
  const std::span<const Vertex> vertices = hits_.chains().vertices(chain);
  if (vertices.front().is_of_end()) {
    // It consists of the ray alone, which mark() tests, too.
    const uint32_t end = hits_.chains().end(chain);
    return is_own(end) || context_.beams.reach(end) & placed_ ||
           std::any_of(vertices.begin(), vertices.end(), [&](const Vertex& vertex) {
             return vertex.lamp() != scene::kNone && test_.touches_light(vertex.lamp(), own.to);
           });
  }
  // Which of the lights a vertex asks depends on all lights that may give something there; where
  // directions go, on all beams.
  return placed_ || lit_by_changed(own.near) || test_.touches(own, [&](const auto& visit) {
    for (const Vertex& vertex : vertices)
      if (vertex.lamp() != scene::kNone && (vertex.is_of_end() || !apart))
        visit(vertex.lamp(), vertex.is_of_end());
  });
}

}  // namespace deltalux::gather
