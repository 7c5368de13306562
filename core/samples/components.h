// SPDX-License-Identifier: Apache-2.0
// Connected parts of a graph, as of faces that share edges.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace deltalux::samples {

/// Union-find over things numbered from 0: the root of a part is its first thing.
class Components {
 public:
  explicit Components(size_t count);
  void join(size_t one, size_t two);
  /// Of each thing the number of its part; parts are numbered in the order of their first things.
  /// Ends the joining.
  std::vector<int32_t> numbers() &&;

 private:
  uint32_t root(uint32_t thing);
  std::vector<uint32_t> parent_;
};

/// Parts of a graph with edges from one[i] to two[i], all below `count`.
std::vector<int32_t> connected_components(std::span<const int64_t> one,
                                          std::span<const int64_t> two, size_t count);

}  // namespace deltalux::samples
