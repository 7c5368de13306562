// SPDX-License-Identifier: Apache-2.0
// Cuts batches of paths by a range; joins neighbours into runs, so that a session with all paths
// has one run.
#include "session/world/held_paths.h"

namespace deltalux::session {

std::pair<uint64_t, uint64_t> HeldPaths::of_batch(const trace::Light& light, uint32_t batch) const {
  const uint64_t begin = trace::batch_begin(light, batch, batches_);
  const uint64_t count = trace::batch_begin(light, batch + 1, batches_) - begin;
  // No overflow: all paths together are fewer than 2^32.
  return {begin + count * range_.first / paths_, begin + count * range_.last / paths_};
}

void HeldPaths::add(const trace::Light& light) {
  for (uint32_t batch = 0; batch < batches_; ++batch) {
    const auto [begin, end] = of_batch(light, batch);
    if (begin == end) continue;
    const uint64_t path = light.first_path + begin;
    DELTALUX_ASSERT(runs_.empty() || path > path_of(uint32_t(size_ - 1)));
    const bool follows =
        !runs_.empty() && runs_.back().first_path + (size_ - runs_.back().first_slot) == path;
    if (!follows) runs_.push_back({path, size_});
    size_ += end - begin;
  }
}

}  // namespace deltalux::session
