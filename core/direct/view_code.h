// SPDX-License-Identifier: Apache-2.0
// Encodes a FixedView in 32 bits: its kind, or the index of its data if it is `partial`; and
// standard errors in 16.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>

#include "direct/visibility.h"

namespace deltalux::direct {

inline constexpr uint32_t kFirstKindCode = 0xfffffff0u;

constexpr uint32_t code_of(FixedView::Kind kind, size_t partial_index = 0) {
  return kind == FixedView::Kind::partial ? uint32_t(partial_index)
                                          : kFirstKindCode + uint32_t(kind);
}
constexpr bool is_kind(uint32_t code) { return code >= kFirstKindCode; }
constexpr FixedView::Kind kind_of(uint32_t code) { return FixedView::Kind(code - kFirstKindCode); }

/// An error, not negative, to eight bits of precision: the upper half of its single precision.
inline uint16_t error_code(float error) {
  return uint16_t((std::bit_cast<uint32_t>(error) + 0x8000u) >> 16);
}
inline float error_of(uint16_t code) { return std::bit_cast<float>(uint32_t(code) << 16); }
inline constexpr uint16_t kMaxErrorCode = 0x7f7f;  // the largest that is finite

/// The data of a FixedView of kind `partial`.
struct StoredView {
  uint64_t bits = 0;  // coarse rays; 1 bit `divided`; 16 bits error
  trace::RayBits fine{};
  double share = 0;
  StoredView() = default;
  explicit StoredView(const FixedView& view)
      : bits(view.coarse | uint64_t(view.divided) << 47 |
             uint64_t(error_code(view.seen.error)) << 48),
        fine(view.fine),
        share(view.seen.share) {}
  FixedView view() const {
    constexpr uint64_t kRays = kCoarseBits | kCornerBits;
    return {FixedView::Kind::partial,
            bits & kRays,
            fine,
            {share, error_of(uint16_t(bits >> 48))},
            bool(bits >> 47 & 1)};
  }
};

}  // namespace deltalux::direct
