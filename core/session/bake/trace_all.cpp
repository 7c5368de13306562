// SPDX-License-Identifier: Apache-2.0
// Traces in steps that each take the same share of every batch.
#include "session/bake/trace_all.h"

#include <algorithm>

#include "base/assertion.h"
#include "session/flow/path_update.h"

namespace deltalux::session {
namespace {

constexpr uint64_t kSlotsPerStep = 65536;  // slots allocated between two checks for cancellation

/// Traces all paths, in steps that each take the same share of every batch.
PathCounts trace_lights(State& s, Progress& progress) {
  const uint64_t total = s.paths.cut.size();
  std::vector<uint32_t> slots;
  for (uint64_t done = 0; done < total; done += slots.size()) {
    progress.check();
    s.paths.store.bounce(0).allocate(std::min(total - done, kSlotsPerStep), s.paths.store.extras(),
                                     slots);
  }
  PathUpdate update(s);
  const uint64_t steps = (total + kPathsPerStep - 1) / kPathsPerStep;
  for (uint64_t step = 0; step < steps; ++step) {
    slots.clear();
    for (const trace::Light& light : s.lights) {
      // Each batch contributes the same share to every step.
      for (uint32_t batch = 0; batch < kBatches; ++batch) {
        const auto [from, end] = s.paths.held.of_batch(light, batch);
        const uint64_t count = end - from;
        const uint64_t first = count * step / steps, last = count * (step + 1) / steps;
        if (first == last) continue;
        const uint32_t slot = s.paths.held.slot_of(uint32_t(light.first_path + from));
        for (uint64_t i = first; i < last; ++i) slots.push_back(uint32_t(slot + i));
      }
    }
    update.start(slots, progress);
    progress.advance(slots.size());
  }
  return update.counts();
}

}  // namespace

void trace_all(State& s, Progress& progress, Frame& frame) {
  s.paths.prepare();
  s.discs.clear_sums();
  s.sharing.added.clear();
  s.sharing.added_since.reset();
  s.sharing.sent.reset();
  const uint64_t paths = s.paths.held.size();
  progress.begin("trace paths", paths);
  const PathCounts counts = trace_lights(s, progress);
  DELTALUX_ASSERT(
      std::all_of(s.discs.sums.begin(), s.discs.sums.end(), [](int64_t sum) { return sum >= 0; }));
  frame.retraced_segments = counts.retraced;
  frame.affected_paths = paths;
  frame.milliseconds.emplace_back("trace", counts.trace_ms);
  frame.milliseconds.emplace_back("deposit", counts.deposit_ms);
}

}  // namespace deltalux::session
