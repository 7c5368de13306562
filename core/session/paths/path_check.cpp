// SPDX-License-Identifier: Apache-2.0
// Walks all chains of segments once: none may lead out of the store, or join another.
#include "session/paths/path_check.h"

#include <cmath>

#include "session/world/snapshot_check.h"

namespace deltalux::session::snapshot {

using segments::BounceSegments;
using segments::HitSlots;
using segments::kNoSlot;
using segments::Segment;

void check_level_sizes(std::span<const uint64_t> sizes, uint64_t paths, uint32_t max_bounces) {
  if (sizes.size() > max_bounces) refuse("\"level_sizes\" has too many bounces");
  const uint64_t first = sizes.empty() ? 0 : sizes[0];
  if (first != paths)
    refuse("bounce 0 has " + std::to_string(first) + " segments for " + std::to_string(paths) +
           " paths");
  for (uint64_t size : sizes)
    if (size > paths) refuse("a bounce has more segments than there are paths");
}

SegmentCheck::SegmentCheck(const scene::Scene& scene, uint64_t paths, size_t discs)
    // Paths from a sun may start up to a diagonal away from the world box, and miss it.
    : around_(scene.world().padded(2 * scene.world().diagonal())),
      longest_(4 * around_.diagonal()),
      paths_(paths),
      primitives_(scene.primitives()),
      discs_(discs) {}

void SegmentCheck::operator()(const Segment& s, float reach, const HitSlots& hits,
                              uint32_t bounce) const {
  const Vec3f o = s.origin;
  const bool sound = s.path < paths_ && std::isfinite(o.x + o.y + o.z) &&
                     around_.contains(Box{o, o}) && s.length >= 0 && reach >= s.length &&
                     reach <= longest_ &&
                     std::max({s.power[0], s.power[1], s.power[2]}) <= 1u << 31 &&
                     (s.primitive == scene::kNone || s.primitive < primitives_);
  if (!sound) refuse("a segment of bounce " + std::to_string(bounce) + " is not sound");
  const auto known = [&](uint32_t disc) { return disc == HitSlots::kFree || disc < discs_; };
  if (hits.disc[0] != HitSlots::kMany && !(known(hits.disc[0]) && known(hits.disc[1])))
    refuse("a segment refers to a disc that is not there");
}

void check_chains(const segments::SegmentStore& store, const HeldPaths& held) {
  const std::vector<BounceSegments>& bounces = store.bounces();
  for (uint32_t b = 0; b < bounces.size(); ++b) {
    const bool last = b + 1 == bounces.size();
    std::vector<bool> followed(last ? 0 : bounces[b + 1].size());
    for (uint32_t slot = 0; slot < bounces[b].size(); ++slot) {
      const Segment& s = bounces[b].at(slot);
      if (b == 0 && s.path != held.path_of(slot)) refuse("a first segment is not that of its path");
      if (s.length < 0 || s.next == kNoSlot) continue;
      if (s.next >= followed.size() || followed[s.next] || bounces[b + 1].at(s.next).length < 0 ||
          bounces[b + 1].at(s.next).path != s.path)
        refuse("a path is not one chain of segments");
      followed[s.next] = true;
    }
    for (uint32_t slot = 0; slot < followed.size(); ++slot)
      if (bounces[b + 1].at(slot).length >= 0 && !followed[slot])
        refuse("a segment does not belong to the path before it");
  }
}

void check_pending(const std::vector<PendingPath>& pending, const std::vector<uint16_t>& cut,
                   const segments::SegmentStore& store, const HeldPaths& held) {
  std::vector<bool> waiting(cut.size());
  for (const PendingPath& p : pending) {
    const size_t first = held.find(p.path).value_or(uint32_t(cut.size()));
    if (first >= cut.size() || waiting[first] || cut[first] != p.bounce ||
        p.bounce >= store.bounces().size() || p.slot >= store.bounces()[p.bounce].size() ||
        store.bounces()[p.bounce].at(p.slot).path != p.path ||
        (p.bounce > 0 && store.bounces()[p.bounce].at(p.slot).length < 0))
      refuse("\"pending\" refers to a segment that is not there");
    waiting[first] = true;
  }
  for (size_t slot = 0; slot < cut.size(); ++slot)
    if (cut[slot] != kNotCut && !waiting[slot]) refuse("\"cut\" marks a path that does not wait");
}

}  // namespace deltalux::session::snapshot
