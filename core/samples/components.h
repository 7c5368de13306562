// SPDX-License-Identifier: Apache-2.0
// Connected components of a graph, such as faces that share edges.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace deltalux::samples {

/// Union-find over elements numbered from 0; the root of a component is its first element.
class Components {
 public:
  explicit Components(size_t count);
  void join(size_t one, size_t two);
  /// Returns the component number of each element; components are numbered in the order of their
  /// first elements. No joining is possible afterwards.
  std::vector<int32_t> numbers() &&;

 private:
  uint32_t root(uint32_t thing);
  std::vector<uint32_t> parent_;
};

/// The connected components of a graph with edges from one[i] to two[i], all below `count`.
std::vector<int32_t> connected_components(std::span<const int64_t> one,
                                          std::span<const int64_t> two, size_t count);

}  // namespace deltalux::samples
