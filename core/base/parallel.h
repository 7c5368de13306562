// SPDX-License-Identifier: Apache-2.0
// Threads: one arena whose size the user chooses. Only parallel.cpp uses oneTBB.
#pragma once
#include <cstddef>
#include <functional>
#include <memory>

namespace deltalux {

/// Runs work in parallel. Work must give the same result for every number of threads: blocks have
/// fixed bounds (multiples of `grain`), and callers combine results by integer sums or by block
/// index.
class Workers {
 public:
  /// 0 = all processors.
  explicit Workers(int threads = 0);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int threads() const { return threads_; }
  /// Calls body(begin, end) for blocks [k*grain, (k+1)*grain) of [0, count); rethrows the first
  /// exception of a body.
  void for_blocks(size_t count, size_t grain,
                  const std::function<void(size_t, size_t)>& body) const;

 private:
  struct Arena;
  std::unique_ptr<Arena> arena_;
  int threads_;
};

}  // namespace deltalux
