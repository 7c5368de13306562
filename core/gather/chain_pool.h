// SPDX-License-Identifier: Apache-2.0
// Chains of all samples, stored tightly; freed places are used again.
#pragma once
#include <span>
#include <vector>

#include "gather/chain.h"

namespace deltalux::gather {

class ChainPool {
 public:
  /// Returns its number. `vertices`: at most kMostVertices.
  uint32_t add(std::span<const Vertex> vertices, uint32_t end, float weight,
               const Passage& passage);
  void remove(uint32_t number);
  void clear();
  void reserve(size_t chains, size_t vertices);

  std::span<const Vertex> vertices(uint32_t number) const {
    return {vertices_.data() + chains_[number].first, chains_[number].count};
  }
  uint32_t end(uint32_t number) const { return chains_[number].end; }
  float weight(uint32_t number) const { return chains_[number].weight; }
  const Passage& passage(uint32_t number) const { return passages_[number]; }
  size_t size() const { return chains_.size() - free_.size(); }
  /// Of all chains, and some that are gone.
  size_t vertex_count() const { return vertices_.size(); }
  size_t bytes() const;

 private:
  struct Stored {
    size_t first = 0;
    uint32_t count = 0, end = kDark;
    float weight = 1;
  };
  std::vector<Stored> chains_;
  std::vector<Passage> passages_;  // of each; apart, since evaluation does not read them
  std::vector<uint32_t> free_;
  std::vector<Vertex> vertices_;
  std::array<std::vector<size_t>, kMostVertices + 1> gaps_;  // in vertices_, by length
};

}  // namespace deltalux::gather
