// SPDX-License-Identifier: Apache-2.0
// The chains of all samples in compact storage; freed storage is reused.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "base/chunks.h"
#include "base/parallel.h"
#include "gather/hits/chain.h"

namespace deltalux::gather {

/// What light along chains depends on beside their geometry: reflectances and dimming.
struct Paint {
  std::vector<Vec3f> reflectance;  ///< by material
  std::vector<float> dim;          ///< by light, followed by a 0 for vertices without light
  /// Irradiance by caustics, by cell; empty if there are none.
  std::vector<std::array<float, 3>> caustics{};
  float caustic(uint32_t cell, size_t channel) const {
    return cell < caustics.size() ? caustics[cell][channel] : 0.0f;
  }
  friend bool operator==(const Paint&, const Paint&) = default;
};

/// Stores chains by number.
class ChainPool {
  struct Range {
    uint32_t first = 0, count = 0;
  };

 public:
  /// Stores a chain and returns its number. `vertices`: at most kMaxVertices.
  uint32_t add(std::span<const Vertex> vertices, uint32_t end, float weight,
               const trace::Footprint& footprint);
  void remove(uint32_t number);
  void clear();

  std::span<const Vertex> vertices(uint32_t number) const {
    return {&vertices_[chains_[number].first], chains_[number].count};
  }
  /// Whether a chain brings what one of these vertices, end and weight would.
  bool is(uint32_t number, std::span<const Vertex> vertices, uint32_t end, float weight) const;
  uint32_t end(uint32_t number) const { return sent_[number].end; }
  float weight(uint32_t number) const { return sent_[number].weight; }
  /// The light that a chain sends back along the ray: `direct` from its vertices, plus `through`
  /// times the radiosity of its end.
  struct Sent {
    std::array<float, 3> direct{}, through{};
    uint32_t end = kDark;
    float weight = 1;
  };
  /// of one chain, without vertices
  static constexpr size_t kBytes = sizeof(Range) + sizeof(Sent) + sizeof(trace::Footprint);
  /// As computed by the last paint().
  const Sent& sent(uint32_t number) const { return sent_[number]; }
  /// Recomputes the light of all chains if `paint` changed.
  void paint(const Paint& paint, const Workers& workers);
  const trace::Footprint& footprint(uint32_t number) const { return footprints_[number]; }
  size_t size() const { return chains_.size() - free_.size(); }
  /// Number of vertices of all chains, including some of removed chains.
  size_t vertex_count() const { return vertices_.size(); }
  size_t bytes() const;

 private:
  void send(uint32_t number, const Paint& paint);
  void add_gap(size_t length);

  Paint paint_;           // without materials: paint() was not called yet
  Chunks<Range> chains_;  // storage of each chain in vertices_
  // By chain; stored separately, since evaluation reads nothing else.
  Chunks<Sent> sent_;
  Chunks<trace::Footprint> footprints_;  // by chain
  std::vector<uint32_t> free_;
  Chunks<Vertex> vertices_;  // the vertices of a chain are contiguous
  // free storage in vertices_, by length
  std::array<std::vector<uint32_t>, kMaxVertices + 1> gaps_;
};

}  // namespace deltalux::gather
