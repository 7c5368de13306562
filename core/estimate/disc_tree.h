// SPDX-License-Identifier: Apache-2.0
// The bounding-volume hierarchy of a disc index: eight boxes per node, eight discs per leaf. Plain
// data, so that kernels for other instruction sets can include this file.
#pragma once
#include <cstddef>
#include <cstdint>

namespace deltalux::estimate {

inline constexpr int kWidth = 8;
/// Set in DiscLeaf::disc for discs with an outline.
inline constexpr uint32_t kClippedBit = 0x80000000u;

/// Children lie side by side: lanes [0, inner) are nodes inner_base + lane, the following ones
/// leaves leaf_base + lane, the rest empty (low = +inf, high = -inf).
struct alignas(64) DiscNode {
  float bound[6][kWidth];  ///< low x, high x, low y, high y, low z, high z
  uint32_t inner_base, leaf_base, inner;
};

/// Structure of arrays. Empty lanes have a zero normal: they cannot be crossed.
struct alignas(64) DiscLeaf {
  float cx[kWidth], cy[kWidth], cz[kWidth];
  float nx[kWidth], ny[kWidth], nz[kWidth];
  float radius[kWidth];
  uint32_t disc[kWidth];
};

}  // namespace deltalux::estimate
