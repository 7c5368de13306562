// SPDX-License-Identifier: Apache-2.0
// Digests: hashes of everything that values depend on, in the present and after any further edit.
#include <cstring>
#include <optional>
#include <span>

#include "base/error.h"
#include "session/session.h"
#include "session/world/lanes.h"

namespace deltalux::session {
namespace {

void chain_chain(Lanes& lanes, const gather::ChainPool& chains, uint32_t number) {
  lanes.chain(uint64_t(bits(chains.weight(number))) << 32 | chains.end(number));
  for (const gather::Vertex& vertex : chains.vertices(number)) {
    lanes.chain(uint64_t(vertex.material) << 32 | vertex.light);
    lanes.chain_all(vertex.direct);
  }
  // decides after which edits the chain is traced again
  const trace::Footprint& footprint = chains.footprint(number);
  lanes.chain(footprint.near);
  lanes.chain(footprint.from), lanes.chain(footprint.to);
}

void chain_looks(Lanes& lanes, const gather::Looks& looks) {
  for (size_t sample = 0; sample < looks.samples(); ++sample) {
    lanes.chain_all(looks.weights(sample));
    const size_t first = looks.rays().first(sample);
    const std::span<const uint32_t> targets = looks.targets(sample);
    for (size_t ray = 0; ray < targets.size(); ++ray) {
      const bool chained = gather::Looks::is_chain(targets[ray]);
      lanes.chain(uint64_t(looks.in_beam(first + ray)) << 33 | uint64_t(chained) << 32 |
                  (chained ? 0 : targets[ray]));
      if (chained) chain_chain(lanes, looks.chains(), gather::Looks::chain_of(targets[ray]));
    }
  }
}

void chain_guiding(Lanes& lanes, const gather::Guiding& guiding) {
  static_assert(sizeof(gather::Guide) % 4 == 0 && sizeof(gather::BeamGuide) % 4 == 0 &&
                sizeof(gather::RayShares) % 4 == 0);
  const auto chain = [&lanes](const void* bytes, size_t size) {
    uint32_t word;
    for (size_t at = 0; at < size; at += sizeof word) {
      std::memcpy(&word, static_cast<const char*>(bytes) + at, sizeof word);
      lanes.chain(word);
    }
  };
  chain(guiding.guides.data(), guiding.guides.size() * sizeof(gather::Guide));
  chain(guiding.beams.data(), guiding.beams.size() * sizeof(gather::BeamGuide));
  chain(guiding.suns.data(), guiding.suns.size() * sizeof(uint32_t));
  chain(&guiding.need, sizeof guiding.need);
  for (int8_t own : guiding.doublings) lanes.chain(uint64_t(own));
  chain(guiding.shares.data(), guiding.shares.size() * sizeof(gather::RayShares));
}

void chain_gather(Lanes& lanes, const Gather& own, const gather::Guiding& guiding) {
  lanes.chain(bits(own.cells.metre()));
  for (uint32_t cell = 0; cell < own.cells.size(); ++cell) {
    lanes.chain(bits(own.cells.area(cell)) << 32 | own.cells.material(cell));
    lanes.chain(own.cells.share(cell));
  }
  lanes.chain_all(own.sums.quanta);
  lanes.chain_all(own.coverage.covered());
  chain_looks(lanes, own.looks);
  chain_guiding(lanes, guiding);
  for (size_t beam = 0; beam < own.beams.size(); ++beam)
    for (uint32_t k = 0; k < gather::Beam::kPoints; ++k) {
      const gather::Beam::Point& point = own.beams[beam].point(k);
      lanes.chain(point.at), lanes.chain(point.normal), lanes.chain(point.primitive);
    }
}

void chain_scene(Lanes& lanes, const State& s) {
  for (uint32_t i = 0; i < s.scene.objects.size(); ++i) {
    const scene::Object& object = s.scene.objects[i];
    if (!object.movable) continue;
    lanes.chain(object.present);
    for (const Vec3d& row : object.pose.row)
      for (int axis = 0; axis < 3; ++axis) lanes.chain(bits(row[axis]));
    for (int axis = 0; axis < 3; ++axis) lanes.chain(bits(object.pose.translation[axis]));
    lanes.chain(s.caster->object_bounds(i));
  }
  lanes.chain(s.scene.world());
  lanes.chain(bits(s.caster->margin()));
  lanes.chain_all(s.group_factor);
  for (const scene::Material& material : s.scene.materials) lanes.chain(material.reflectance);
}

void chain_lights(Lanes& lanes, const State& s) {
  for (const trace::Light& light : s.lights) {
    lanes.chain(light.first_path), lanes.chain(light.path_count);
    lanes.chain(uint64_t(light.on) << 32 | light.group), lanes.chain(uint64_t(light.finer));
    for (int c = 0; c < 3; ++c) lanes.chain(bits(light.power[c]));
    if (light.map)
      for (const trace::SunMap::Leaf& leaf : light.map->leaves)
        lanes.chain(Vec3f{leaf.u, leaf.v, leaf.size}), lanes.chain(bits(leaf.below));
    if (!light.aims) continue;
    for (const trace::AimMap::Target& target : light.aims->targets)
      lanes.chain(target.centre), lanes.chain(bits(target.radius));
    for (const float below : light.aims->below) lanes.chain(bits(below));
  }
  lanes.chain_all(s.light_sampled);
  lanes.chain(bits(s.scale.quantum));
  lanes.chain(uint64_t(s.scale.digits));
  if (s.direct.scales) lanes.chain(bits(s.direct.scales->quantum));
  lanes.chain_all(s.slack);
}

}  // namespace

SegmentsHash Session::segments_hash() const {
  check_whole();
  return state_->paths.hash();
}

std::array<uint64_t, 4> Session::digest(const std::optional<SegmentsHash>& others) const {
  check_whole();
  check_added();
  check_looked();
  const State& s = *state_;
  if (s.holds_none() && s.all_paths() && !others)
    throw OptionError(
        "digest: the segments are in other sessions; give the sum of their segments_hash");
  const SegmentsHash own = segments_hash();
  Lanes all{own.a, own.b};
  if (others) all.merge({others->a, others->b});
  Lanes ordered = all;
  s.discs.digest(ordered);
  s.direct.digest(ordered);
  if (s.gather) chain_gather(ordered, *s.gather, s.guiding);
  chain_lights(ordered, s);
  chain_scene(ordered, s);
  return {all.a, all.b, ordered.a, ordered.b};
}

}  // namespace deltalux::session
