// SPDX-License-Identifier: Apache-2.0
// Fault injection for tests: lets the k-th operation of a kind fail. Costs one load per operation.
#pragma once
#include <atomic>
#include <cstdint>

namespace deltalux::fault {

/// building an acceleration structure; checking for cancellation
enum class Kind : uint8_t { commit, cancel };

inline std::atomic<int64_t> countdown[2] = {0, 0};  // 0 = none

/// Lets the k-th operation of `kind` from now on fail, once.
inline void arm(Kind kind, int64_t k) { countdown[size_t(kind)].store(k); }

inline bool due(Kind kind) noexcept {
  std::atomic<int64_t>& left = countdown[size_t(kind)];
  return left.load(std::memory_order_relaxed) > 0 && left.fetch_sub(1) == 1;
}

}  // namespace deltalux::fault
