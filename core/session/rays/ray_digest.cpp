// SPDX-License-Identifier: Apache-2.0
// Chains what gather rays met, and what the next edit reads to cast them again.
#include <cstring>
#include <span>

#include "session/rays/ray_layer.h"

namespace deltalux::session {
namespace {

void chain_chain(Lanes& lanes, const gather::ChainPool& chains, uint32_t number) {
  lanes.chain(uint64_t(bits(chains.weight(number))) << 32 | chains.end(number));
  for (const gather::Vertex& vertex : chains.vertices(number)) {
    lanes.chain(uint64_t(vertex.material) << 32 | vertex.light);
    lanes.chain(uint64_t(bits(vertex.direct)) << 32 | bits(vertex.weight));
  }
  // where lights are asked again after edits, and after which the chain is traced again
  for (const gather::Place& place : chains.places(number)) {
    lanes.chain(place.point());
    lanes.chain(uint64_t(place.normal) << 32 | bits(place.plane));
  }
  // Whether tints of 1 are stored depends on what was there before.
  const std::span<const gather::Tint> tints = chains.tints(number);
  for (size_t k = 0; k < tints.size(); ++k)
    if (tints[k] != gather::Tint{}) lanes.chain(uint64_t(k) << 32 | tints[k].bits());
  lanes.chain(chains.tip(number));
}

void chain_hits(Lanes& lanes, const gather::GatherHits& hits) {
  for (size_t sample = 0; sample < hits.samples(); ++sample) {
    lanes.chain_all(hits.weights(sample));
    const size_t first = hits.rays().first(sample);
    const std::span<const uint32_t> targets = hits.targets(sample);
    for (size_t ray = 0; ray < targets.size(); ++ray) {
      const bool chained = gather::GatherHits::is_chain(targets[ray]);
      lanes.chain(uint64_t(hits.in_beam(first + ray)) << 33 | uint64_t(chained) << 32 |
                  (chained ? 0 : targets[ray]));
      if (chained) chain_chain(lanes, hits.chains(), gather::GatherHits::chain_of(targets[ray]));
    }
  }
}

void chain_guiding(Lanes& lanes, const gather::Guiding& guiding) {
  static_assert(sizeof(gather::Guide) % 4 == 0 && sizeof(gather::BeamGuide) % 4 == 0 &&
                sizeof(gather::RayAllotment) % 4 == 0);
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
  chain(guiding.allotments.data(), guiding.allotments.size() * sizeof(gather::RayAllotment));
}

}  // namespace

void RayLayer::digest(Lanes& lanes) const {
  if (!world.gathers()) return;
  chain_hits(lanes, hits);
  chain_guiding(lanes, guiding);
  for (size_t beam = 0; beam < beams.size(); ++beam)
    for (uint32_t k = 0; k < gather::Beam::kPoints; ++k) {
      const gather::Beam::Point& point = beams[beam].point(k);
      lanes.chain(point.at), lanes.chain(point.normal), lanes.chain(point.primitive);
    }
}

}  // namespace deltalux::session
