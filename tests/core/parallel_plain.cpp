// SPDX-License-Identifier: Apache-2.0
// Workers over plain threads, in place of base/parallel.cpp when ThreadSanitizer looks for races:
// it cannot see how oneTBB, a library of the system, synchronises, and would report what is none.
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "base/parallel.h"

namespace deltalux {

struct Workers::Arena {};

Workers::Workers(int threads)
    : threads_(threads > 0 ? threads : std::max(2, int(std::thread::hardware_concurrency()))) {}

Workers::~Workers() = default;

void Workers::for_blocks(size_t count, size_t grain,
                         const std::function<void(size_t, size_t)>& body) const {
  const size_t blocks = (count + grain - 1) / grain;
  std::atomic<size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    for (size_t block; (block = next.fetch_add(1)) < blocks;) {
      try {
        body(block * grain, std::min(count, (block + 1) * grain));
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = blocks;
      }
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (size_t i = 1; i < std::min(size_t(threads_), blocks); ++i) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace deltalux
