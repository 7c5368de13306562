// SPDX-License-Identifier: Apache-2.0
// Sums are integers, so that the order in which threads add does not matter.
#include "session/flow/landings.h"

#include <atomic>

#include "base/assertion.h"
#include "base/direction.h"

namespace deltalux::session {
namespace {

constexpr size_t kGrain = 1024;

}  // namespace

Landings::Landings(State& state) : state_(state) {
  if (!state.gathers()) return;
  finder_.emplace(state.scene, state.cells.division);
  by_shadow_ray_ = state.rays.lights_by_shadow_ray();
}

void Landings::note(segments::BounceSegments& stored, uint32_t slot) const {
  if (!finder_) return;
  const segments::Segment& segment = stored.at(slot);
  stored.landing(slot) = segment.primitive == scene::kNone
                             ? gather::kNoCell
                             : finder_->find(segment.primitive, segment.origin,
                                             decode_direction(segment.direction), segment.length);
}

void Landings::add(uint32_t bounce, std::span<const uint32_t> slots, int sign) const {
  if (!finder_) return;
  segments::BounceSegments& stored = state_.paths.store.bounce(bounce);
  gather::CellSums& sums = state_.cells.sums;
  state_.workers.for_blocks(slots.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const segments::Segment& segment = stored.at(slots[i]);
      const uint32_t cell = segment.length < 0 ? gather::kNoCell : stored.landing(slots[i]);
      if (cell == gather::kNoCell) continue;
      DELTALUX_ASSERT(cell < sums.touched.size());
      const size_t number = state_.light_of(segment.path);
      const segments::LightHistory history = state_.paths.store.history(bounce, slots[i]);
      if (history == segments::LightHistory::direct && by_shadow_ray_[number]) continue;
      const trace::Light& light = state_.lights[number];
      const uint32_t batch = trace::batch_of(light, segment.path - light.first_path, kBatches);
      const auto add_to = [&](uint32_t group) {
        const size_t at = sums.at(cell, group, batch);
        for (size_t c = 0; c < 3; ++c)
          std::atomic_ref(sums.quanta[at + c])
              .fetch_add(sign * int64_t(segment.power[c]), std::memory_order_relaxed);
      };
      add_to(state_.cell_group(light.sums, false));
      if (history == segments::LightHistory::caustic) add_to(state_.cell_group(light.sums, true));
      std::atomic_ref(sums.touched[cell]).store(1, std::memory_order_relaxed);
    }
  });
}

double Landings::share_lit_by(uint32_t light, std::span<const uint32_t> hits) const {
  std::vector<uint8_t> lit(hits.size());
  const segments::SegmentStore& store = state_.paths.store;
  const uint32_t paths = store.bounces().empty() ? 0 : store.bounces()[0].size();
  for (uint32_t path = 0; path < paths; ++path)
    store.each_direct(path, [&](uint32_t bounce, uint32_t slot) {
      const segments::BounceSegments& stored = store.bounces()[bounce];
      const segments::Segment& segment = stored.at(slot);
      const uint32_t cell = segment.length < 0 ? gather::kNoCell : stored.landing(slot);
      if (cell != gather::kNoCell && state_.light_of(segment.path) == light &&
          (segment.power[0] | segment.power[1] | segment.power[2]))
        lit[cell] = 1;
    });
  uint64_t all = 0, own = 0;
  for (size_t cell = 0; cell < hits.size(); ++cell)
    all += hits[cell], own += lit[cell] * hits[cell];
  return all ? double(own) / double(all) : 0.0;
}

}  // namespace deltalux::session
