// SPDX-License-Identifier: Apache-2.0
// Chains of all samples, stored tightly; freed places are used again.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "base/chunks.h"
#include "base/parallel.h"
#include "gather/chain.h"

namespace deltalux::gather {

/// What chains are seen by: it changes without any of them.
struct Paint {
  std::vector<Vec3f> reflectance;  ///< per material
  std::vector<float> dim;          ///< per light; one more, 0, for none
  friend bool operator==(const Paint&, const Paint&) = default;
};

class ChainPool {
  struct Place {
    uint32_t first = 0, count = 0;
  };

 public:
  /// Returns its number. `vertices`: at most kMaxVertices.
  uint32_t add(std::span<const Vertex> vertices, uint32_t end, float weight,
               const Passage& passage);
  void remove(uint32_t number);
  void clear();

  std::span<const Vertex> vertices(uint32_t number) const {
    return {&vertices_[chains_[number].first], chains_[number].count};
  }
  uint32_t end(uint32_t number) const { return sent_[number].end; }
  float weight(uint32_t number) const { return sent_[number].weight; }
  /// What a chain sends: from its own lights, and how much of its end's radiosity.
  struct Sent {
    std::array<float, 3> direct{}, through{};
    uint32_t end = kDark;
    float weight = 1;
  };
  static constexpr size_t kBytes = sizeof(Place) + sizeof(Sent) + sizeof(Passage);  ///< of a chain
  /// As painted last.
  const Sent& sent(uint32_t number) const { return sent_[number]; }
  void paint(const Paint& paint, const Workers& workers);
  const Passage& passage(uint32_t number) const { return passages_[number]; }
  size_t size() const { return chains_.size() - free_.size(); }
  /// Of all chains, and some that are gone.
  size_t vertex_count() const { return vertices_.size(); }
  size_t bytes() const;

 private:
  void send(uint32_t number, const Paint& paint);
  void add_gap(size_t length);

  Paint paint_;               // without materials: not painted yet
  Chunks<Place> chains_;      // in vertices_
  Chunks<Sent> sent_;         // of each; apart, since evaluation reads nothing else
  Chunks<Passage> passages_;  // of each
  std::vector<uint32_t> free_;
  Chunks<Vertex> vertices_;                                   // those of a chain in a row
  std::array<std::vector<uint32_t>, kMaxVertices + 1> gaps_;  // in vertices_, by length
};

}  // namespace deltalux::gather
