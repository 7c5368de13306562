// SPDX-License-Identifier: Apache-2.0
// The hash that digests are made of.
#pragma once
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "base/random.h"
#include "base/vec.h"

namespace deltalux::session {

inline uint64_t bits(float v) {
  v += 0.0f;  // -0 becomes +0
  uint32_t u;
  std::memcpy(&u, &v, 4);
  return u;
}
inline uint64_t bits(double v) {
  v += 0.0;  // -0 becomes +0
  uint64_t u;
  std::memcpy(&u, &v, 8);
  return u;
}

/// A hash of two independent 64-bit lanes. merge() adds hashes, so that the order of items does not
/// matter.
struct Lanes {
  uint64_t a = 0, b = 0;
  /// Appends a word, in order.
  void chain(uint64_t word) {
    a = combine(a ^ 0x243f6a8885a308d3ull, word);
    b = combine(b ^ 0x13198a2e03707344ull, ~word);
  }
  void chain(Vec3f v) {
    chain(bits(v.x) << 32 | bits(v.y));
    chain(bits(v.z));
  }
  void chain(const Box& box) { chain(box.low), chain(box.high); }
  template <class T>
  void chain_all(const T& values) {
    for (const auto value : values) {
      if constexpr (std::is_floating_point_v<std::remove_cv_t<decltype(value)>>)
        chain(bits(value));
      else
        chain(uint64_t(value));
    }
  }
  void merge(const Lanes& o) { a += o.a, b += o.b; }
};

}  // namespace deltalux::session
