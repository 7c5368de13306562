// SPDX-License-Identifier: Apache-2.0
// Reorders sums between the order that the samples have in memory and that of the user.
#include "session/shared/path_sums.h"

namespace deltalux::session {
namespace {

/// Where in the user's order the number at `i` belongs.
size_t place(size_t i, size_t width, std::span<const uint32_t> given) {
  const size_t row = i / width, n = given.size();
  return width * (row / n * n + given[row % n]) + i % width;
}

}  // namespace

std::vector<int64_t> in_given_order(std::span<const int64_t> own, size_t width,
                                    std::span<const uint32_t> given) {
  std::vector<int64_t> out(own.size());
  for (size_t i = 0; i < own.size(); ++i) out[place(i, width, given)] = own[i];
  return out;
}

void add_in_given_order(std::span<const int64_t> sums, size_t width,
                        std::span<const uint32_t> given, std::span<int64_t> own) {
  for (size_t i = 0; i < own.size(); ++i) own[i] += sums[place(i, width, given)];
}

}  // namespace deltalux::session
