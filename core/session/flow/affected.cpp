// SPDX-License-Identifier: Apache-2.0
// Finds the segments that an edit changes: one scan over the cell boxes of all segments yields
// candidates for every changed object, in its old and its new pose, and for its moving samples; an
// exact test decides.
#include "session/flow/affected.h"

#include <algorithm>

#include "base/assertion.h"
#include "base/direction.h"
#include "session/paths/scan.h"

namespace deltalux::session {
namespace {

using segments::BounceSegments;
using segments::Segment;

constexpr size_t kGrain = 16 * BounceSegments::kChunk;
constexpr size_t kAhead = 16;

/// The result of searching one block of slots; the results of all blocks are joined in order.
struct BlockResult {
  std::vector<AffectedSegment> affected;
  std::vector<std::vector<uint32_t>> near;
  uint64_t candidates = 0;
};

bool passes(const SlabRay& ray, const Box& box, float reach) {
  return !box.empty() && ray.entry(box, reach) <= reach;
}

class Finder {
 public:
  Finder(const State& state, std::span<const ObjectChange> changes,
         std::span<const uint8_t> materials)
      : state_(state),
        changes_(changes),
        materials_(materials),
        changed_(state.scene.objects.size()) {
    for (const ObjectChange& change : changes) {
      changed_[change.object] = 1;
      Box near = change.after;
      for (const MovingPart& part : state.discs.moving)
        if (part.object == change.object && !change.after.empty()) near.grow(part.world);
      near_.push_back(near);
      add_box(change.before);
      add_box(near);
    }
  }

  BlockResult search(const BounceSegments& stored, uint32_t begin, uint32_t end) const {
    BlockResult found;
    found.near.resize(changes_.size());
    thread_local std::vector<uint32_t> candidates;
    candidates.clear();
    for (uint32_t slot = begin; slot < end; slot += BounceSegments::kChunk) {
      const BounceSegments::Chunk& chunk = stored.chunk(slot);
      if (materials_.empty()) {
        scan(chunk.low, chunk.high, BounceSegments::kChunk, boxes_, slot, candidates);
      } else {
        for (uint32_t i = 0; i < BounceSegments::kChunk; ++i)
          if (chunk.segment[i].length >= 0) candidates.push_back(slot + i);
      }
    }
    found.candidates = candidates.size();
    for (size_t i = 0; i < candidates.size(); ++i) {
      if (i + kAhead < candidates.size()) {
        const char* ahead = reinterpret_cast<const char*>(&stored.at(candidates[i + kAhead]));
        __builtin_prefetch(ahead);
        __builtin_prefetch(ahead + sizeof(Segment) - 1);
      }
      test(stored, candidates[i], found);
    }
    return found;
  }

 private:
  void add_box(const Box& box) {
    if (!box.empty()) boxes_.push_back(scan_box(state_.paths.store.grid(), box));
  }

  /// Tests one candidate exactly: does the edit change its first hit, or does it pass an object's
  /// own samples?
  void test(const BounceSegments& stored, uint32_t slot, BlockResult& found) const {
    const Segment& segment = stored.at(slot);
    if (segment.length < 0) return;
    const Vec3f o = segment.origin, w = decode_direction(segment.direction);
    const SlabRay ray(o, w);
    const float reach = stored.extended_or_length(slot);
    AffectedSegment result{slot, false, {}};
    bool affected = false;
    if (segment.primitive != scene::kNone) {
      if (segment.primitive >= state_.scene.static_primitives())
        affected = changed_[state_.scene.object_of(segment.primitive)];
      if (!materials_.empty())
        affected |= materials_[state_.scene.material_index(segment.primitive)] != 0;
    }
    const bool retrace = affected || state_.paths.store.with_extended();
    if (segment.primitive != scene::kNone) result.hit = {segment.length, segment.primitive, {}};
    for (size_t k = 0; k < changes_.size(); ++k) {
      const ObjectChange& change = changes_[k];
      if (passes(ray, near_[k], reach)) found.near[k].push_back(slot);
      if (state_.paths.store.with_extended())
        // With segments that go on behind the first hit, that piece counts too. Tracing the path
        // again decides what really changed.
        affected |= passes(ray, change.before, reach) || passes(ray, change.after, reach);
      if (retrace || change.after.empty()) continue;
      result.hit = state_.caster->closer(result.hit, change.object, o, w);
    }
    if (!retrace && result.hit.primitive != segment.primitive) {
      // No other object and no static geometry changed, so this is the new first hit.
      affected = result.hit_known = true;
    }
    if (affected) found.affected.push_back(result);
  }

  const State& state_;
  std::span<const ObjectChange> changes_;
  std::span<const uint8_t> materials_;
  std::vector<uint8_t> changed_;
  std::vector<Box> near_;
  std::vector<ScanBox> boxes_;
};

bool is_applied(const State& state, const ObjectChange& change) {
  if (change.object >= state.scene.objects.size()) return false;
  const Box& now = state.caster->object_bounds(change.object);
  return now.low == change.after.low && now.high == change.after.high;
}

}  // namespace

Affected find_affected(const State& state, std::span<const ObjectChange> changes,
                       std::span<const uint8_t> materials, Progress& progress) {
  DELTALUX_ASSERT(std::all_of(changes.begin(), changes.end(), [&](const ObjectChange& change) {
    return is_applied(state, change);
  }));
  const Finder finder(state, changes, materials);
  const std::vector<BounceSegments>& bounces = state.paths.store.bounces();
  Affected out;
  out.segments.resize(bounces.size());
  out.near.assign(changes.size(), std::vector<std::vector<uint32_t>>(bounces.size()));
  progress.begin("find affected paths", bounces.size());
  for (size_t bounce = 0; bounce < bounces.size(); ++bounce) {
    const BounceSegments& stored = bounces[bounce];
    std::vector<BlockResult> blocks((stored.size() + kGrain - 1) / kGrain);
    state.workers.for_blocks(stored.size(), kGrain, [&](size_t begin, size_t end) {
      progress.check();
      blocks[begin / kGrain] = finder.search(stored, uint32_t(begin), uint32_t(end));
    });
    out.scanned += stored.size();
    for (const BlockResult& block : blocks) {
      out.candidates += block.candidates;
      out.segments[bounce].insert(out.segments[bounce].end(), block.affected.begin(),
                                  block.affected.end());
      for (size_t k = 0; k < changes.size(); ++k)
        out.near[k][bounce].insert(out.near[k][bounce].end(), block.near[k].begin(),
                                   block.near[k].end());
    }
    progress.advance(1);
  }
  return out;
}

}  // namespace deltalux::session
