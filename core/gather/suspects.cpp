// SPDX-License-Identifier: Apache-2.0
// Tests what rays met, and the shadow rays that they depend on, against the boxes of what moved.
#include "gather/suspects.h"

#include <algorithm>
#include <limits>

#include "direct/block.h"

namespace deltalux::gather {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

}  // namespace

Suspects::Suspects(const Looks& looks, const Present& present, const Change& change)
    : looks_(looks), present_(present), change_(change) {
  for (const MovedObject& moved : change.objects) {
    own_.push_back(present.cells.of_object(moved.object));
    boxes_.insert(boxes_.end(), moved.passed.begin(), moved.passed.end());
  }
  const float slack = direct::slack(present.caster);
  for (const trace::Light& light : present.lights)
    for (const Box& box : boxes_) shadows_.emplace_back(light, box, slack);
  if (change.beams.touched && !change.beams.placed) shade_beams(slack);
}

void Suspects::shade_beams(float slack) {
  for (size_t b = 0; b < present_.beams.size(); ++b)
    for (const Box& box : boxes_)
      if (present_.beams[b].may_meet(box))
        beam_shadows_.emplace_back(present_.lights[present_.beams[b].guide().light], box, slack);
  shaded_.resize(present_.cells.size());
  present_.cells.each_landing(present_.scene, {}, [&](uint32_t cell, const BodyCells::Ball& ball) {
    if (!present_.beams.reach(cell)) return;
    const Box point{ball.centre, ball.centre};
    shaded_[cell] = !misses_beams(point.padded(ball.radius));
  });
}

bool Suspects::misses_beams(const Box& points) const {
  return std::all_of(beam_shadows_.begin(), beam_shadows_.end(),
                     [&](const direct::ShadowVolume& shadow) { return shadow.misses(points); });
}

bool Suspects::shaded(uint32_t target) const {
  if (change_.beams.placed) return true;
  if (!Looks::is_chain(target)) return shaded_[target];
  const Passage& passage = looks_.chains().passage(Looks::chain_of(target));
  return !misses_beams(passage.near) || !misses_beams({passage.last, passage.last});
}

bool Suspects::passes_by(std::span<const uint32_t> targets) const {
  Box near;
  for (uint32_t target : targets)
    if (Looks::is_chain(target)) near.grow(looks_.chains().passage(Looks::chain_of(target)).near);
  if (near.empty()) return true;
  for (const Box& box : boxes_)
    if (box.overlaps(near)) return false;
  return std::all_of(shadows_.begin(), shadows_.end(),
                     [&](const direct::ShadowVolume& shadow) { return shadow.misses(near); });
}

void Suspects::mark(const SampleRays& rays, size_t sample, bool apart,
                    std::vector<uint8_t>& again) const {
  const std::span<const uint32_t> targets = looks_.targets(sample);
  const size_t first = looks_.rays().first(sample);
  for (size_t ray = 0; ray < targets.size(); ++ray)
    again[ray] = gone(targets[ray], apart) ||
                 (change_.beams.touched && looks_.in_beam(first + ray) && shaded(targets[ray]));
  if (change_.beams.touched)
    rays.each_moved(change_.beams.points, [&](uint32_t ray) { again[ray] = 1; });
  for (const MovedObject& moved : change_.objects) {
    if (moved.now.empty()) continue;
    rays.each_towards(moved.now.centre(), 0.5001f * moved.now.diagonal(), [&](uint32_t ray) {
      if (again[ray]) return;
      const Vec3f w = rays.aim(ray).w;
      again[ray] = !(w == Vec3f{}) && SlabRay(rays.origin(), w).entry(moved.now, kFar) < kFar &&
                   present_.caster.closest_object(moved.object, rays.origin(), w).valid();
    });
  }
}

bool Suspects::gone(uint32_t target, bool apart) const {
  if (target == kDark) return false;
  if (Looks::is_chain(target)) return touches(Looks::chain_of(target), apart);
  return is_own(target) || change_.suns || present_.beams.reach(target) & change_.beams.placed;
}

bool Suspects::is_own(uint32_t cell) const {
  return std::any_of(own_.begin(), own_.end(),
                     [&](const auto& range) { return cell >= range.first && cell < range.second; });
}

bool Suspects::touches(uint32_t chain, bool apart) const {
  if (change_.lights) return true;
  const Passage& passage = looks_.chains().passage(chain);
  const std::span<const Vertex> vertices = looks_.chains().vertices(chain);
  if (vertices.back().is_of_end() && shines(vertices.back(), passage.last)) return true;
  // A far hit: mark() tests all rays of samples for what is in their way now.
  if (vertices.front().is_of_end()) return is_own(looks_.chains().end(chain));
  const SlabRay last(passage.origin, passage.last - passage.origin);
  for (const Box& box : boxes_)
    if (last.entry(box, 1) < kFar) return true;
  if (apart) return false;
  for (const Box& box : boxes_)
    if (box.overlaps(passage.near)) return true;
  for (const Vertex& vertex : vertices)
    if (vertex.light != scene::kNone && !vertex.is_of_end()) {
      for (const direct::ShadowVolume& shadow : shadows_of(vertex.light))
        if (!shadow.misses(passage.near)) return true;
    }
  return false;
}

bool Suspects::shines(const Vertex& vertex, Vec3f end) const {
  // a beam, for which in_beam tells
  if (!present_.lights[vertex.light].is_parallel()) return false;
  const auto shadows = shadows_of(vertex.light);
  return std::any_of(shadows.begin(), shadows.end(),
                     [&](const direct::ShadowVolume& shadow) { return shadow.contains(end); });
}

}  // namespace deltalux::gather
