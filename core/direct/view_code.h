// SPDX-License-Identifier: Apache-2.0
// Encodes a FixedView in 32 bits: its kind, or the index of its data if it is `partial`.
#pragma once
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

}  // namespace deltalux::direct
