// SPDX-License-Identifier: Apache-2.0
// The bounding volume hierarchy of a disc index: eight boxes per node, up to eight discs per leaf.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "samples/disc_set.h"

namespace deltalux::estimate {

inline constexpr int kLanes = 8;
/// Number of bits of a node's index; the segment's index in its batch takes the rest of 32 bits.
inline constexpr int kNodeBits = 25;

/// Children are contiguous: lanes [0, inner) are the nodes inner_base + lane, the next lanes are
/// the leaves leaf_base + lane (modulo 2^32), the rest are empty (low = +inf, high = -inf).
struct alignas(64) DiscNode {
  float bound[6][kLanes];  ///< low x, high x, low y, high y, low z, high z
  uint32_t inner_base, leaf_base, inner;
};

/// Discs as a structure of arrays. Empty lanes have a zero normal, so that nothing crosses them.
struct alignas(64) DiscLeaf {
  static constexpr uint32_t kClipped = 0x80000000u;
  float cx[kLanes], cy[kLanes], cz[kLanes];
  float nx[kLanes], ny[kLanes], nz[kLanes];
  float radius[kLanes];
  uint32_t disc[kLanes];  ///< index into the DiscSet; kClipped is set for discs with an outline
};

struct DiscTree {
  std::vector<DiscNode> nodes;  ///< the root first; empty without discs
  std::vector<DiscLeaf> leaves;
  int depth = 0;    ///< number of nodes on the longest path from the root
  float reach = 0;  ///< largest absolute coordinate of the boxes, positive
  float max_radius = 0;

  size_t bytes() const {
    return nodes.size() * sizeof(DiscNode) + leaves.size() * sizeof(DiscLeaf);
  }
};

/// O(n log n); the tree does not depend on the number of workers. Throws Cancelled, and
/// OptionError for a disc that is not finite, too far away, or of negative radius.
DiscTree build_disc_tree(const samples::DiscSet& discs, const Workers& workers, Progress* progress);

}  // namespace deltalux::estimate
