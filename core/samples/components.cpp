// SPDX-License-Identifier: Apache-2.0
// The root of a component is its element with the lowest index, whatever the order of the edges; so
// are the component numbers.
#include "samples/components.h"

#include <algorithm>
#include <numeric>

#include "base/error.h"

namespace deltalux::samples {

Components::Components(size_t count) : parent_(count) {
  if (count > 0x7fffffffu) throw Error("mesh: more than 2e9 corners");
  std::iota(parent_.begin(), parent_.end(), 0u);
}

uint32_t Components::root(uint32_t thing) {
  while (parent_[thing] != thing) {
    parent_[thing] = parent_[parent_[thing]];
    thing = parent_[thing];
  }
  return thing;
}

void Components::join(size_t one, size_t two) {
  const uint32_t a = root(uint32_t(one)), b = root(uint32_t(two));
  parent_[std::max(a, b)] = std::min(a, b);
}

std::vector<int32_t> Components::numbers() && {
  std::vector<int32_t> number(parent_.size());
  int32_t parts = 0;
  // roots come before the other elements of their components
  for (uint32_t i = 0; i < parent_.size(); ++i)
    number[i] = parent_[i] == i ? parts++ : number[root(i)];
  return number;
}

std::vector<int32_t> connected_components(std::span<const int64_t> one,
                                          std::span<const int64_t> two, size_t count) {
  Components components(count);
  for (size_t i = 0; i < one.size(); ++i) components.join(size_t(one[i]), size_t(two[i]));
  return std::move(components).numbers();
}

}  // namespace deltalux::samples
