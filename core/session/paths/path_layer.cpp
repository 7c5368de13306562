// SPDX-License-Identifier: Apache-2.0
// Prepares, hashes, saves and restores paths.
#include "session/paths/path_layer.h"

#include "gather/cells/cells.h"

#include "session/paths/path_check.h"
#include "session/world/snapshot_check.h"

namespace deltalux::session {
namespace {

constexpr uint32_t kPerChunk = segments::BounceSegments::kChunk;

std::string level_name(size_t bounce, const char* what) {
  return "level" + std::to_string(bounce) + "." + what;
}

void append_bounce(const PathLayer& paths, size_t bounce, ArchiveView& archive) {
  const segments::BounceSegments& stored = paths.store.bounces()[bounce];
  const segments::Extras& extras = paths.store.extras();
  const std::string segments = level_name(bounce, "segments"), hits = level_name(bounce, "hits"),
                    extended = level_name(bounce, "extended"),
                    landing = level_name(bounce, "landing"),
                    history = level_name(bounce, "history");
  archive.append(segments, std::span<const segments::Segment>());
  archive.append(hits, std::span<const segments::HitSlots>());
  archive.append(extended, std::span<const float>());
  if (extras.landing) archive.append(landing, std::span<const uint32_t>());
  if (extras.history) archive.append(history, std::span<const segments::LightHistory>());
  for (uint32_t slot = 0; slot < stored.size(); slot += kPerChunk) {
    const segments::BounceSegments::Chunk& chunk = stored.chunk(slot);
    const size_t count = std::min(kPerChunk, stored.size() - slot);
    archive.append(segments, std::span(chunk.segment).first(count));
    if (paths.world.counts_in_discs()) archive.append(hits, std::span(chunk.slots).first(count));
    if (extras.extended)
      archive.append(extended, std::span<const float>(chunk.extended.get(), count));
    if (extras.landing)
      archive.append(landing, std::span<const uint32_t>(chunk.landing.get(), count));
    if (extras.history)
      archive.append(history, std::span<const segments::LightHistory>(chunk.history.get(), count));
  }
}

Lanes of_segment(const World& s, const segments::Segment& g, float extended,
                 segments::LightHistory history, uint32_t bounce) {
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
  if (history == segments::LightHistory::caustic) lanes.chain(1);
  return lanes;
}

}  // namespace

void PathLayer::prepare() {
  held = world.held();
  store = segments::SegmentStore(world.scene.world(), world.extras());
  cut.assign(held.size(), kNotCut);
  pending.clear();
}

void PathLayer::wait() {
  prepare();
  cut.clear();
  for (const uint32_t slot : add_unused())
    pending.push_back({held.path_of(slot), slot, 0, false, {}});
  std::fill(cut.begin(), cut.end(), uint16_t(0));
}

std::vector<uint32_t> PathLayer::add_unused() {
  std::vector<uint32_t> slots;
  store.bounce(0).allocate(held.size() - cut.size(), store.extras(), slots);
  cut.resize(held.size(), kNotCut);
  for (const uint32_t slot : slots) {
    store.bounce(0).at(slot) = segments::unused_segment(held.path_of(slot));
    store.bounce(0).slots(slot) = {};
  }
  return slots;
}

double PathLayer::bytes_per_segment() const {
  const bool extended = world.options.segment_end != segments::SegmentEnd::first;
  constexpr double kSpare = 1.05;  // chunks are not all full
  return kSpare *
         (sizeof(segments::BounceSegments::Chunk) / double(segments::BounceSegments::kChunk) +
          (extended ? double(sizeof(float)) : 0.0) +
          (world.gathers() ? double(sizeof(uint32_t)) : 0.0) +
          (world.extras().history ? double(sizeof(segments::LightHistory)) : 0.0));
}

SegmentsHash PathLayer::hash() const {
  Lanes all;
  uint64_t count = 0;
  for (uint32_t b = 0; b < store.bounces().size(); ++b) {
    const segments::BounceSegments& stored = store.bounces()[b];
    for (uint32_t slot = 0; slot < stored.size(); ++slot) {
      if (stored.at(slot).length < 0) continue;
      all.merge(of_segment(world, stored.at(slot), stored.extended_or_length(slot),
                           store.history(b, slot), b));
      ++count;
    }
  }
  return {count, all.a, all.b};
}

std::vector<uint64_t> PathLayer::level_sizes() const {
  std::vector<uint64_t> sizes;
  for (const segments::BounceSegments& stored : store.bounces()) sizes.push_back(stored.size());
  return sizes;
}

void PathLayer::save(ArchiveView& archive) const {
  archive.append("cut", cut);
  std::vector<uint32_t> rows;  // without known hits, which only save time
  for (const PendingPath& p : pending) rows.insert(rows.end(), {p.path, p.slot, p.bounce});
  archive.keep("pending", rows);
  for (size_t bounce = 0; bounce < store.bounces().size(); ++bounce)
    append_bounce(*this, bounce, archive);
}

void PathLayer::restore(ArchiveSource& archive, uint32_t cells, size_t discs, Progress& progress) {
  store = segments::SegmentStore(world.scene.world(), world.extras());
  const segments::Extras extras = world.extras();
  const auto sizes =
      archive.read_all<uint64_t>("level_sizes", archive.count<uint64_t>("level_sizes"));
  snapshot::check_level_sizes(sizes, held.size(), world.options.max_bounces);
  uint64_t total = 0;
  for (size_t b = 0; b < sizes.size(); ++b, total += sizes[b - 1]) {
    archive.expect<segments::Segment>(level_name(b, "segments"), sizes[b]);
    archive.expect<segments::HitSlots>(level_name(b, "hits"),
                                       world.counts_in_discs() ? sizes[b] : 0);
    archive.expect<float>(level_name(b, "extended"), extras.extended ? sizes[b] : 0);
    if (extras.landing) archive.expect<uint32_t>(level_name(b, "landing"), sizes[b]);
    if (extras.history) archive.expect<segments::LightHistory>(level_name(b, "history"), sizes[b]);
  }
  progress.begin("restore segments", total);
  const snapshot::SegmentCheck check(world.scene, world.all_paths(), discs);
  std::vector<uint32_t> slots, unused;
  for (uint32_t b = 0; b < sizes.size(); ++b) {
    segments::BounceSegments& stored = store.bounce(b);
    stored.allocate(sizes[b], extras, slots);
    unused.clear();
    for (uint32_t begin = 0; begin < sizes[b]; begin += kPerChunk) {
      segments::BounceSegments::Chunk& chunk = stored.chunk(begin);
      const uint32_t count = uint32_t(std::min<uint64_t>(kPerChunk, sizes[b] - begin));
      archive.read(level_name(b, "segments"), std::span(chunk.segment).first(count));
      if (world.counts_in_discs())
        archive.read(level_name(b, "hits"), std::span(chunk.slots).first(count));
      if (extras.extended)
        archive.read(level_name(b, "extended"), std::span(chunk.extended.get(), count));
      if (extras.landing)
        archive.read(level_name(b, "landing"), std::span(chunk.landing.get(), count));
      if (extras.history)
        archive.read(level_name(b, "history"), std::span(chunk.history.get(), count));
      for (uint32_t slot = begin; slot < begin + count; ++slot) {
        segments::Segment& g = stored.at(slot);
        if (g.length < 0) {
          g = segments::unused_segment(g.path);
          stored.slots(slot) = {};
          if (b > 0) unused.push_back(slot);
          continue;
        }
        check(g, stored.extended_or_length(slot), stored.slots(slot), b);
        if (extras.landing && stored.landing(slot) != gather::kNoCell &&
            stored.landing(slot) >= cells)
          snapshot::refuse("\"" + level_name(b, "landing") + "\" names a cell that is not there");
        using segments::LightHistory;
        if (const LightHistory own = store.history(b, slot);
            own > LightHistory::indirect || (b == 0 && own != LightHistory::direct))
          snapshot::refuse("\"" + level_name(b, "history") + "\" says what no light has met");
        store.index(b, slot);
      }
      progress.advance(count);
      progress.check();
    }
    for (uint32_t slot : unused) stored.release(slot);
  }
  snapshot::check_chains(store, held);
  cut = archive.read_all<uint16_t>("cut", held.size());
  restore_pending(archive);
}

void PathLayer::restore_pending(ArchiveSource& archive) {
  const size_t count = archive.count<uint32_t>("pending");
  if (count % 3 || count / 3 > cut.size()) snapshot::refuse("\"pending\" is incomplete");
  const auto rows = archive.read_all<uint32_t>("pending", count);
  for (size_t i = 0; i < rows.size(); i += 3) {
    if (rows[i + 2] >= kNotCut) snapshot::refuse("\"pending\" names a bounce that is not there");
    pending.push_back({rows[i], rows[i + 1], uint16_t(rows[i + 2]), false, {}});
  }
  snapshot::check_pending(pending, cut, store, held);
}

}  // namespace deltalux::session
