// SPDX-License-Identifier: Apache-2.0
// The only file that uses oneTBB.
#include "base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "base/assertion.h"

namespace deltalux {

struct Workers::Arena {
  explicit Arena(int threads) : arena(threads) {}
  tbb::task_arena arena;
};

Workers::Workers(int threads)
    : threads_(threads > 0 ? threads : tbb::this_task_arena::max_concurrency()) {
  if (threads_ > 1) arena_ = std::make_unique<Arena>(threads_);
}

Workers::~Workers() = default;

void Workers::for_blocks(size_t count, size_t grain,
                         const std::function<void(size_t, size_t)>& body) const {
  DELTALUX_ASSERT(grain > 0);
  const size_t blocks = (count + grain - 1) / grain;
  const auto run = [&](size_t block) { body(block * grain, std::min(count, (block + 1) * grain)); };
  if (!arena_ || blocks < 2) {
    for (size_t block = 0; block < blocks; ++block) run(block);
    return;
  }
  arena_->arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, blocks, 1),
        [&](const tbb::blocked_range<size_t>& range) {
          for (size_t block = range.begin(); block != range.end(); ++block) run(block);
        },
        tbb::simple_partitioner());
  });
}

}  // namespace deltalux
