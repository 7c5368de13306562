// SPDX-License-Identifier: Apache-2.0
// Failures on purpose: tests let the k-th of what can fail do so. Costs one load where it is asked.
#pragma once
#include <atomic>
#include <cstdint>

namespace deltalux::fault {

enum class Kind : uint8_t { commit, cancel };  ///< of an acceleration structure; a look at the flag

inline std::atomic<int64_t> countdown[2] = {0, 0};  // 0 = none

/// The k-th time from now that `kind` is asked, it fails, once.
inline void arm(Kind kind, int64_t k) { countdown[size_t(kind)].store(k); }

inline bool due(Kind kind) noexcept {
  std::atomic<int64_t>& left = countdown[size_t(kind)];
  return left.load(std::memory_order_relaxed) > 0 && left.fetch_sub(1) == 1;
}

}  // namespace deltalux::fault
