// SPDX-License-Identifier: Apache-2.0
// Traces wavefronts: all segments of one bounce are traced, stored and deposited before the next
// bounce.
#include "session/flow/path_update.h"

#include <algorithm>
#include <array>

#include "base/assertion.h"
#include "base/stopwatch.h"

namespace deltalux::session {
namespace {

using segments::BounceSegments;
using segments::kNoSlot;
using segments::Segment;

constexpr size_t kGrain = 256;
constexpr size_t kAhead = 12;

/// Marks the segments as unused: those of `cut` keep their slots, those of `gone` free them.
void empty_slots(BounceSegments& stored, std::span<const uint32_t> cut,
                 std::span<const uint32_t> gone) {
  for (uint32_t slot : gone) {
    stored.at(slot).length = -1;
    stored.set_cell_box(slot, segments::ScanGrid::kUnused);
    stored.release(slot);
  }
  for (uint32_t slot : cut) {
    Segment& segment = stored.at(slot);
    segment.length = -1;
    segment.next = kNoSlot;
  }
}

trace::Flight flight_of(const Segment& segment) {
  return {segment.origin,
          segment.direction,
          {segment.power[0], segment.power[1], segment.power[2]},
          segment.path};
}

}  // namespace

PathUpdate::PathUpdate(State& state)
    : state_(state), walk_(state.walk()), deposit_(state.paths, state.discs), landings_(state) {
  for (const trace::Light& light : state.lights)
    quanta_.push_back(trace::birth_quanta(light, state.scale, state.birth_factor(light)));
}

void PathUpdate::write_birth(Segment& segment, const trace::Light& light, uint64_t index) const {
  if (!light.on) {
    segment.path = uint32_t(light.first_path + index);
    segment.length = -1;
    return;
  }
  const trace::Flight flight =
      walk_.birth(light, index, quanta_[size_t(&light - state_.lights.data())]);
  segment.origin = flight.origin;
  segment.direction = flight.direction;
  std::copy(flight.power, flight.power + 3, segment.power);
  segment.path = flight.path;
  segment.length = 0;
}

void PathUpdate::start(std::span<const uint32_t> own, const Progress& progress) {
  BounceSegments& stored = state_.paths.store.bounce(0);
  std::vector<Wavefront> fresh(1);
  fresh[0].slots.assign(own.begin(), own.end());
  std::vector<uint32_t>& slots = fresh[0].slots;
  state_.workers.for_blocks(slots.size(), kGrain, [&](size_t from, size_t to) {
    for (size_t i = from; i < to; ++i) {
      const uint32_t path = state_.paths.held.path_of(slots[i]);
      const trace::Light& light = state_.lights[state_.light_of(path)];
      Segment& segment = stored.at(slots[i]);
      segment = segments::unused_segment(path);
      write_birth(segment, light, path - light.first_path);
    }
  });
  std::erase_if(slots, [&](uint32_t slot) { return stored.at(slot).length < 0; });
  advance(std::move(fresh), &progress);
}

void PathUpdate::replace(std::span<const PendingPath> pending,
                         const std::function<void()>& between) {
  std::vector<BounceSegments>& bounces = state_.paths.store.bounces();
  // cut[b]: segments traced again in their slots; gone[b]: segments after them, deleted.
  std::vector<std::vector<uint32_t>> cut(bounces.size() + 1), gone(bounces.size() + 1);
  std::vector<Wavefront> fresh(bounces.size() + 1);
  std::vector<PendingPath> unknown;
  {
    ScopeTime watch(counts_.remove_ms);
    for (const PendingPath& p : pending) {
      uint16_t& mark = state_.paths.cut[state_.paths.held.slot_of(p.path)];
      DELTALUX_ASSERT(mark == p.bounce && bounces[p.bounce].at(p.slot).path == p.path);
      mark = kNotCut;
      cut[p.bounce].push_back(p.slot);
      // trace() expects the segments with known hits first.
      if (p.hit_known) {
        fresh[p.bounce].slots.push_back(p.slot);
        fresh[p.bounce].hits.push_back(p.hit);
      } else {
        unknown.push_back(p);
      }
      ++counts_.paths;
    }
    for (const PendingPath& p : unknown) fresh[p.bounce].slots.push_back(p.slot);
    for (uint32_t b = 0; b < bounces.size(); ++b) {
      for (const auto* list : {&cut[b], &gone[b]})
        for (size_t i = 0; i < list->size(); ++i) {
          if (i + kAhead < list->size()) __builtin_prefetch(&bounces[b].at((*list)[i + kAhead]));
          const Segment& segment = bounces[b].at((*list)[i]);
          counts_.removed += segment.length >= 0;
          if (segment.next == kNoSlot) continue;
          DELTALUX_ASSERT(bounces[b + 1].at(segment.next).path == segment.path);
          gone[b + 1].push_back(segment.next);
        }
      for (const auto* list : {&cut[b], &gone[b]}) {
        deposit_.remove(b, *list);
        landings_.add(b, *list, -1);
      }
    }
    deposit_.finish();
    for (uint32_t b = 0; b < bounces.size(); ++b) empty_slots(bounces[b], cut[b], gone[b]);
  }
  if (between) {
    ScopeTime watch(counts_.moving_ms);
    between();
  }
  for (uint32_t slot : cut[0]) {
    Segment& segment = bounces[0].at(slot);
    const trace::Light& light = state_.lights[state_.light_of(segment.path)];
    write_birth(segment, light, segment.path - light.first_path);
    if (segment.length < 0) bounces[0].set_cell_box(slot, segments::ScanGrid::kUnused);
  }
  // Lights that are off have no paths; erase_if keeps the order of the rest.
  std::erase_if(fresh[0].slots, [&](uint32_t slot) { return bounces[0].at(slot).length < 0; });
  advance(std::move(fresh), nullptr);
}

void PathUpdate::advance(std::vector<Wavefront> fresh, const Progress* progress) {
  std::vector<uint32_t> children;
  for (uint32_t b = 0; b < fresh.size() || !children.empty(); ++b) {
    Wavefront wavefront;
    if (b < fresh.size()) wavefront = std::move(fresh[b]);
    wavefront.slots.insert(wavefront.slots.end(), children.begin(), children.end());
    children.clear();
    if (wavefront.slots.empty()) continue;
    if (progress) progress->check();
    {
      ScopeTime watch(counts_.trace_ms);
      trace(b, wavefront, children);
      counts_.retraced += wavefront.slots.size();
    }
    if (progress) progress->check();
    ScopeTime watch(counts_.deposit_ms);
    deposit_.add(b, wavefront.slots);
    landings_.add(b, wavefront.slots, +1);
  }
  ScopeTime watch(counts_.deposit_ms);
  deposit_.finish();
}

void PathUpdate::write(uint32_t bounce, uint32_t slot, const trace::Interaction& interaction) {
  BounceSegments& stored = state_.paths.store.bounce(bounce);
  Segment& segment = stored.at(slot);
  segment.length = interaction.length;
  segment.primitive = interaction.primitive;
  segment.next = kNoSlot;
  if (state_.paths.store.with_extended()) stored.extended(slot) = interaction.extended;
  landings_.note(stored, slot);
  state_.paths.store.index(bounce, slot);
}

void PathUpdate::trace(uint32_t bounce, const Wavefront& wavefront,
                       std::vector<uint32_t>& children) {
  DELTALUX_ASSERT(bounce < state_.options.max_bounces);
  const std::vector<uint32_t>& slots = wavefront.slots;
  BounceSegments* stored = &state_.paths.store.bounce(bounce);
  const size_t blocks = (slots.size() + kGrain - 1) / kGrain;
  struct Child {
    trace::Flight flight;
    uint32_t parent;
    surfaces::Lobe lobe;
  };
  std::vector<std::vector<Child>> born(blocks);
  constexpr size_t kTogether = trace::Walk::kTogether;
  state_.workers.for_blocks(slots.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<Child>& own = born[begin / kGrain];
    std::array<trace::Flight, kTogether> flights;
    std::array<trace::Hit, kTogether> hits;
    for (size_t first = begin; first < end; first += kTogether) {
      const size_t count = std::min(kTogether, end - first);
      for (size_t k = 0; k < count; ++k) {
        const size_t i = first + k;
        if (i + kAhead < end) __builtin_prefetch(&stored->at(slots[i + kAhead]));
        flights[k] = flight_of(stored->at(slots[i]));
        hits[k] = i < wavefront.hits.size() ? wavefront.hits[i] : walk_.meet(flights[k]);
      }
      walk_.fetch({hits.data(), count});
      for (size_t k = 0; k < count; ++k) {
        const uint32_t slot = slots[first + k];
        const trace::Interaction interaction = walk_.scatter(flights[k], bounce, hits[k]);
        write(bounce, slot, interaction);
        if (interaction.survives) own.push_back({interaction.next, slot, interaction.lobe});
      }
    }
  });
  size_t total = 0;
  for (const auto& own : born) total += own.size();
  if (!total) return;
  BounceSegments& next = state_.paths.store.bounce(bounce + 1);
  stored =
      &state_.paths.store.bounce(bounce);  // the line above may have moved the bounces in memory
  next.allocate(total, state_.paths.store.extras(), children);
  const bool with_history = state_.paths.store.extras().history;
  size_t k = 0;
  for (const auto& own : born)
    for (const Child& child : own) {
      const uint32_t slot = children[k++];
      Segment& segment = next.at(slot);
      segment.origin = child.flight.origin;
      segment.direction = child.flight.direction;
      std::copy(child.flight.power, child.flight.power + 3, segment.power);
      segment.path = child.flight.path;
      stored->at(child.parent).next = slot;
      if (with_history) next.history(slot) = after(stored->history(child.parent), child.lobe);
    }
}

}  // namespace deltalux::session
