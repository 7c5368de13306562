// SPDX-License-Identifier: Apache-2.0
// Gaps of one length are filled by chains of that length.
#include "gather/chain_pool.h"

#include <algorithm>

#include "base/error.h"

namespace deltalux::gather {

uint32_t ChainPool::add(std::span<const Vertex> vertices, uint32_t end, float weight,
                        const Passage& passage) {
  constexpr size_t kMost = size_t(1) << 31;
  if (free_.empty()) {
    if (chains_.size() >= kMost - 1)
      throw OptionError("gather: more than 2e9 rays meet something near, expected fewer rays");
    if (free_.capacity() <= chains_.size()) free_.reserve(chains_.size() + chains_.size() / 2 + 1);
    passages_.emplace_back();
    chains_.emplace_back();
    free_.push_back(uint32_t(chains_.size() - 1));
  }
  std::vector<size_t>& gaps = gaps_[vertices.size()];
  if (gaps.empty()) {
    vertices_.resize(vertices_.size() + vertices.size());
    gaps.push_back(vertices_.size() - vertices.size());
  }
  const uint32_t number = free_.back();
  Stored& stored = chains_[number];
  stored = {gaps.back(), uint32_t(vertices.size()), end, weight};
  passages_[number] = passage;
  std::copy(vertices.begin(), vertices.end(), vertices_.begin() + long(stored.first));
  gaps.pop_back();
  free_.pop_back();
  return number;
}

void ChainPool::remove(uint32_t number) {
  gaps_[chains_[number].count].push_back(chains_[number].first);
  free_.push_back(number);
}

void ChainPool::clear() {
  chains_.clear(), passages_.clear(), free_.clear(), vertices_.clear();
  for (auto& gaps : gaps_) gaps.clear();
}

void ChainPool::reserve(size_t chains, size_t vertices) {
  chains_.reserve(chains), passages_.reserve(chains);
  vertices_.reserve(vertices);
}

size_t ChainPool::bytes() const {
  size_t sum = chains_.capacity() * sizeof(Stored) + passages_.capacity() * sizeof(Passage) +
               free_.capacity() * sizeof(uint32_t) + vertices_.capacity() * sizeof(Vertex);
  for (const auto& gaps : gaps_) sum += gaps.capacity() * sizeof(size_t);
  return sum;
}

}  // namespace deltalux::gather
