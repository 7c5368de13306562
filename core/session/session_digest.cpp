// SPDX-License-Identifier: Apache-2.0
// Digests: hashes of everything that values depend on, in the present and after any further edit.
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>

#include "base/error.h"
#include "base/random.h"
#include "session/session.h"

namespace deltalux::session {
namespace {

uint64_t bits(float v) {
  v += 0.0f;  // -0 becomes +0
  uint32_t u;
  std::memcpy(&u, &v, 4);
  return u;
}
uint64_t bits(double v) {
  v += 0.0;  // -0 becomes +0
  uint64_t u;
  std::memcpy(&u, &v, 8);
  return u;
}

/// A hash of two independent 64-bit lanes. merge() adds hashes, so that the order of items does not
/// matter.
struct Lanes {
  uint64_t a = 0, b = 0;
  /// Appends a word, in order.
  void chain(uint64_t word) {
    a = combine(a ^ 0x243f6a8885a308d3ull, word);
    b = combine(b ^ 0x13198a2e03707344ull, ~word);
  }
  void chain(Vec3f v) {
    chain(bits(v.x) << 32 | bits(v.y));
    chain(bits(v.z));
  }
  void chain(const Box& box) { chain(box.low), chain(box.high); }
  template <class T>
  void chain_all(const T& values) {
    for (const auto value : values) {
      if constexpr (std::is_floating_point_v<std::remove_cv_t<decltype(value)>>)
        chain(bits(value));
      else
        chain(uint64_t(value));
    }
  }
  void merge(const Lanes& o) { a += o.a, b += o.b; }
};

Lanes of_segment(const State& s, const segments::Segment& g, float extended, uint32_t bounce) {
  Lanes lanes;
  lanes.chain(uint64_t(g.path) << 32 | bounce);
  lanes.chain(bits(g.origin.x) << 32 | bits(g.origin.y));
  lanes.chain(bits(g.origin.z) << 32 | g.direction);
  lanes.chain(bits(g.length) << 32 | bits(extended));
  lanes.chain(uint64_t(g.power[0]) << 32 | g.power[1]);
  const uint32_t object =
      g.primitive == scene::kNone ? scene::kNone : s.scene.object_of(g.primitive);
  const uint32_t local =
      g.primitive == scene::kNone ? 0 : g.primitive - s.scene.objects[object].first_primitive;
  lanes.chain(uint64_t(g.power[2]) << 32 | local);
  lanes.chain(object);
  return lanes;
}

void chain_chain(Lanes& lanes, const gather::ChainPool& chains, uint32_t number) {
  lanes.chain(uint64_t(bits(chains.weight(number))) << 32 | chains.end(number));
  for (const gather::Vertex& vertex : chains.vertices(number)) {
    lanes.chain(uint64_t(vertex.material) << 32 | vertex.light);
    lanes.chain_all(vertex.direct);
  }
  // decides after which edits the chain is traced again
  const gather::Passage& passage = chains.passage(number);
  lanes.chain(passage.near);
  lanes.chain(passage.origin), lanes.chain(passage.last);
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

/// What discs count: energy by batch, of whose spread errors are made, over areas.
void chain_discs(Lanes& lanes, const State& s) {
  lanes.chain_all(s.sums);
  lanes.chain_all(s.area);
  if (s.knows_openness()) lanes.chain_all(s.openness);
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
  if (s.direct_scales) lanes.chain(bits(s.direct_scales->quantum));
  lanes.chain_all(s.slack);
}

}  // namespace

SegmentsHash Session::segments_hash() const {
  check_whole();
  const State& s = *state_;
  Lanes all;
  uint64_t count = 0;
  for (uint32_t b = 0; b < s.store.bounces().size(); ++b) {
    const segments::BounceSegments& stored = s.store.bounces()[b];
    for (uint32_t slot = 0; slot < stored.size(); ++slot) {
      if (stored.at(slot).length < 0) continue;
      all.merge(of_segment(s, stored.at(slot), stored.extended_or_length(slot), b));
      ++count;
    }
  }
  return {count, all.a, all.b};
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
  if (s.counts_in_discs()) chain_discs(ordered, s);
  direct_->each_word([&](uint64_t word) { ordered.chain(word); });
  if (s.gather) chain_gather(ordered, *s.gather, s.guiding);
  chain_lights(ordered, s);
  chain_scene(ordered, s);
  return {all.a, all.b, ordered.a, ordered.b};
}

}  // namespace deltalux::session
