// SPDX-License-Identifier: Apache-2.0
// Sums of a set of discs that follow the changes of a ray map.
#include "estimate/ray_map/tally.h"

#include <algorithm>
#include <mutex>

namespace deltalux::estimate {

void RayMapTally::forget() {
  std::fill(sums_.begin(), sums_.end(), 0);
  first_.clear(), crossings_.clear();
  free_ = kNone, hits_ = 0;
}

RayMapStats RayMapTally::refresh(RayMap& map, std::span<const uint32_t> power,
                                 const Workers& workers, Progress* progress) {
  if (!valid_ || generation_ != map.generation()) {
    forget();
    map.unsettle();
  }
  valid_ = false;
  first_.reserve(map.room());
  first_.resize(map.records().size(), kNone);
  std::mutex mutex;
  const auto take = [&](std::span<const RayMapHit> hits) {
    const std::lock_guard lock(mutex);
    for (const RayMapHit& hit : hits) {
      for (int c = 0; c < 3; ++c)
        sums_[3 * size_t(discs_.id[hit.disc]) + c] += power[3 * size_t(hit.segment) + c];
      const uint32_t place = free_ != kNone ? free_ : uint32_t(crossings_.size());
      if (free_ != kNone)
        free_ = crossings_[place].next;
      else
        crossings_.emplace_back();
      crossings_[place] = {hit.disc, first_[hit.segment]};
      first_[hit.segment] = place;
    }
    hits_ += hits.size();
  };
  const RayMapStats stats = find_crossings(map, discs_, workers, take, progress, name_);
  generation_ = map.generation();
  valid_ = true;
  return stats;
}

void RayMapTally::remove(std::span<const uint32_t> ids, std::span<const uint32_t> power) {
  constexpr size_t kAhead = 8;  // distance of prefetches
  const auto known = [&](size_t i) { return i < ids.size() && ids[i] < first_.size(); };
  for (size_t i = 0; i < ids.size(); ++i) {
    const uint32_t id = ids[i];
    if (known(i + 2 * kAhead)) {
      __builtin_prefetch(&first_[ids[i + 2 * kAhead]]);
      __builtin_prefetch(&power[3 * size_t(ids[i + 2 * kAhead])]);
    }
    if (known(i + kAhead) && first_[ids[i + kAhead]] != kNone)
      __builtin_prefetch(&crossings_[first_[ids[i + kAhead]]]);
    if (id >= first_.size()) continue;  // added after the last refresh
    uint32_t place = first_[id];
    first_[id] = kNone;
    while (place != kNone) {
      Crossed& crossed = crossings_[place];
      for (int c = 0; c < 3; ++c)
        sums_[3 * size_t(discs_.id[crossed.disc]) + c] -= power[3 * size_t(id) + c];
      --hits_;
      const uint32_t next = crossed.next;
      crossed.next = free_, free_ = place;
      place = next;
    }
  }
}

}  // namespace deltalux::estimate
