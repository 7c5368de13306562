// SPDX-License-Identifier: Apache-2.0
// Unpacks blocks of segments into a structure of arrays once; the block then serves every
// estimator.
#include "session/discs/deposit.h"

#include <algorithm>

#include "base/assertion.h"
#include "base/direction.h"

namespace deltalux::session {

using estimate::HitSlots;
using segments::BounceSegments;
using segments::Segment;

namespace {
constexpr size_t kGrain = 256;
constexpr size_t kAhead = 12;  // prefetch distance for reads of segments in random order
constexpr uint32_t kAllAtOnce = 16384;
}  // namespace

struct Deposit::SegmentBlock {
  float ox[kGrain], oy[kGrain], oz[kGrain], dx[kGrain], dy[kGrain], dz[kGrain];
  float length[kGrain], extended[kGrain];
  uint32_t power[3 * kGrain];
  uint16_t slab[kGrain];
  uint32_t slot[kGrain];
  HitSlots hits[kGrain];
  size_t count = 0;

  segments::SegmentSpan span() const {
    return {count, ox, oy, oz, dx, dy, dz, length, extended, power, slab};
  }
};

Deposit::Deposit(PathLayer& paths, DiscLayer& discs) : Deposit(paths, discs, discs.energy()) {}

Deposit::Deposit(PathLayer& paths, DiscLayer& discs, const estimate::EnergySums& sums)
    : world_(discs.world), paths_(paths), discs_(discs), sums_(sums) {
  sums_.shared = false;
  feeds_.emplace_back(*discs.still, sums_, world_.workers);
  for (const MovingPart& part : discs.moving)
    feeds_.emplace_back(*part.index, sums_, world_.workers);
}

void Deposit::finish() {
  for (Feed& feed : feeds_) feed.finish();
}

void Deposit::settle() {
  for (Feed& feed : feeds_) feed.settle();
}

void Deposit::add_all(Progress& progress) {
  const std::vector<BounceSegments>& bounces = paths_.store.bounces();
  progress.begin("deposit", bounces.size());
  std::vector<uint32_t> slots;
  for (uint32_t bounce = 0; bounce < bounces.size(); ++bounce, progress.advance(1))
    for (uint32_t begin = 0; begin < bounces[bounce].size(); begin += kAllAtOnce) {
      progress.check();
      slots.clear();
      const uint32_t end = std::min(bounces[bounce].size(), begin + kAllAtOnce);
      for (uint32_t slot = begin; slot < end; ++slot) slots.push_back(slot);
      for_slabs(bounce, slots, [&](std::span<const uint32_t> own) {
        thread_local SegmentBlock block;
        gather_counting(block, bounce, own);
        if (!block.count) return;
        feeds_[0].add(block.span(), +1);
        to_moving(block, +1);
      });
      settle();
    }
  finish();
}

void Deposit::for_slabs(uint32_t bounce, std::span<const uint32_t> slots,
                        const std::function<void(std::span<const uint32_t>)>& body) {
  if (world_.workers.threads() == 1) {
    for (size_t begin = 0; begin < slots.size(); begin += kGrain)
      body(slots.subspan(begin, std::min(kGrain, slots.size() - begin)));
    return;
  }
  // Counting sort by slab; the last bin takes the segments that do not count.
  const size_t bins = world_.slabs() + 1;
  std::vector<uint16_t> bin(slots.size());
  world_.workers.for_blocks(slots.size(), 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      if (!counts(bounce, slots[i], bin[i])) bin[i] = uint16_t(bins - 1);
  });
  std::vector<size_t> start(bins + 1);
  for (uint16_t b : bin) ++start[b + 1];
  for (size_t b = 0; b < bins; ++b) start[b + 1] += start[b];
  sorted_.resize(slots.size());
  std::vector<size_t> place(start.begin(), start.end() - 1);
  for (size_t i = 0; i < slots.size(); ++i) sorted_[place[bin[i]]++] = slots[i];
  world_.workers.for_blocks(bins - 1, 1, [&](size_t slab, size_t) {
    const std::span<const uint32_t> own(sorted_.data() + start[slab],
                                        start[slab + 1] - start[slab]);
    for (size_t begin = 0; begin < own.size(); begin += kGrain)
      body(own.subspan(begin, std::min(kGrain, own.size() - begin)));
  });
}

bool Deposit::counts(uint32_t bounce, uint32_t slot, uint16_t& slab) const {
  const Segment& segment = paths_.store.bounces()[bounce].at(slot);
  if (segment.length < 0) return false;
  DELTALUX_ASSERT(paths_.held.find(segment.path));
  const size_t light = world_.light_of(segment.path);
  // Gradients come from discs in sessions with a final gather, too.
  const bool gathered = world_.options.gather_rays && !sums_.moments;
  const segments::LightHistory history = paths_.store.history(bounce, slot);
  if (history == segments::LightHistory::direct && world_.light_sampled[light]) return false;
  if (history == segments::LightHistory::indirect && gathered) return false;
  const trace::Light& source = world_.lights[light];
  slab = uint16_t(source.sums * kBatches +
                  trace::batch_of(source, segment.path - source.first_path, kBatches));
  return true;
}

void Deposit::gather(SegmentBlock& block, uint32_t bounce, uint32_t slot, const Segment& segment,
                     uint16_t slab) const {
  DELTALUX_ASSERT(block.count < kGrain && slab < world_.slabs());
  const size_t i = block.count++;
  const Vec3f w = decode_direction(segment.direction);
  block.ox[i] = segment.origin.x, block.oy[i] = segment.origin.y, block.oz[i] = segment.origin.z;
  block.dx[i] = w.x, block.dy[i] = w.y, block.dz[i] = w.z;
  block.length[i] = segment.length;
  block.extended[i] = paths_.store.with_extended()
                          ? paths_.store.bounces()[bounce].extended_or_length(slot)
                          : segment.length;
  for (int c = 0; c < 3; ++c) block.power[3 * i + c] = segment.power[c];
  block.slab[i] = slab;
  block.slot[i] = slot;
}

void Deposit::gather_counting(SegmentBlock& block, uint32_t bounce,
                              std::span<const uint32_t> slots) const {
  const BounceSegments& stored = paths_.store.bounces()[bounce];
  block.count = 0;
  for (size_t i = 0; i < slots.size(); ++i) {
    if (i + kAhead < slots.size()) __builtin_prefetch(&stored.at(slots[i + kAhead]));
    const Segment& segment = stored.at(slots[i]);
    uint16_t slab = 0;
    if (counts(bounce, slots[i], slab)) gather(block, bounce, slots[i], segment, slab);
  }
}

void Deposit::to_part(const MovingPart& part, const SegmentBlock& block, int sign) {
  const FastTransform to_local(world_.scene.objects[part.object].pose.inverse());
  thread_local SegmentBlock local;
  local.count = 0;
  for (size_t i = 0; i < block.count; ++i) {
    const Vec3f o{block.ox[i], block.oy[i], block.oz[i]}, w{block.dx[i], block.dy[i], block.dz[i]};
    if (SlabRay(o, w).entry(part.world, block.extended[i]) > block.extended[i]) continue;
    const size_t k = local.count++;
    const Vec3f lo = to_local.point(o), lw = to_local.direction(w);
    local.ox[k] = lo.x, local.oy[k] = lo.y, local.oz[k] = lo.z;
    local.dx[k] = lw.x, local.dy[k] = lw.y, local.dz[k] = lw.z;
    local.length[k] = block.length[i], local.extended[k] = block.extended[i];
    for (int c = 0; c < 3; ++c) local.power[3 * k + c] = block.power[3 * i + c];
    local.slab[k] = block.slab[i];
  }
  if (local.count) feeds_[1 + size_t(&part - discs_.moving.data())].add(local.span(), sign);
}

void Deposit::to_moving(const SegmentBlock& block, int sign) {
  for (const MovingPart& part : discs_.moving)
    if (part.current && world_.scene.objects[part.object].present) to_part(part, block, sign);
}

void Deposit::add(uint32_t bounce, std::span<const uint32_t> slots) {
  if (!world_.counts_in_discs()) return;
  BounceSegments& stored = paths_.store.bounce(bounce);
  for (uint32_t slot : slots) stored.slots(slot) = {};
  for_slabs(bounce, slots, [&](std::span<const uint32_t> own) {
    thread_local SegmentBlock block;
    gather_counting(block, bounce, own);
    if (!block.count) return;
    feeds_[0].add(block.span(), +1, block.hits);
    for (size_t i = 0; i < block.count; ++i) stored.slots(block.slot[i]) = block.hits[i];
    to_moving(block, +1);
  });
  settle();
}

void Deposit::remove(uint32_t bounce, std::span<const uint32_t> slots) {
  if (!world_.counts_in_discs()) return;
  BounceSegments& stored = paths_.store.bounce(bounce);
  const samples::DiscSet& discs = discs_.still->discs();
  for_slabs(bounce, slots, [&](std::span<const uint32_t> own) {
    thread_local SegmentBlock block, many;
    block.count = many.count = 0;
    for (size_t i = 0; i < own.size(); ++i) {
      if (i + kAhead < own.size()) {
        __builtin_prefetch(&stored.at(own[i + kAhead]));
        __builtin_prefetch(&stored.slots(own[i + kAhead]));
      }
      const Segment& segment = stored.at(own[i]);
      uint16_t slab = 0;
      if (!counts(bounce, own[i], slab)) continue;
      if (!discs_.moving.empty()) gather(block, bounce, own[i], segment, slab);
      const HitSlots& hits = stored.slots(own[i]);
      if (hits.disc[0] == HitSlots::kMany) {
        gather(many, bounce, own[i], segment, slab);
        continue;
      }
      for (uint32_t disc : hits.disc) {
        if (disc == HitSlots::kFree) continue;
        DELTALUX_ASSERT(disc < discs.size());
        sums_.add(slab, discs.id[disc], segment.power, -1);
      }
    }
    if (many.count) feeds_[0].add(many.span(), -1);
    to_moving(block, -1);
  });
  settle();
}

void Deposit::add_to_part(const MovingPart& part, uint32_t bounce,
                          std::span<const uint32_t> slots) {
  for_slabs(bounce, slots, [&](std::span<const uint32_t> own) {
    thread_local SegmentBlock block;
    gather_counting(block, bounce, own);
    to_part(part, block, +1);
  });
}

}  // namespace deltalux::session
