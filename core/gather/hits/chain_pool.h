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
  std::vector<Vec3f> contrast;     ///< by material, see surfaces::Surface
  std::vector<float> dim;          ///< by light
  std::vector<Vec3f> lamp;         ///< by light: its strength, dimmed
  /// Irradiance by caustics, by cell; empty if there are none.
  std::vector<std::array<float, 3>> caustics{};
  Vec3f caustic(uint32_t cell) const {
    if (cell >= caustics.size()) return {};
    return {caustics[cell][0], caustics[cell][1], caustics[cell][2]};
  }
  /// How the reflectance of this material, where it has this tint, compares with the mean.
  Vec3f contrasted(uint32_t index, Tint tint) const {
    return surfaces::tinted({1, 1, 1}, contrast[index], tint.value());
  }
  /// None of a light that was added since, and of kNone.
  Vec3f of_lamp(uint32_t light) const { return light < lamp.size() ? lamp[light] : Vec3f{}; }
  friend bool operator==(const Paint&, const Paint&) = default;
};

/// Stores chains by number.
class ChainPool {
  struct Range {
    uint32_t first = 0, count = 0;
  };

 public:
  /// Stores a chain of at most kMaxVertices and returns its number.
  uint32_t add(const Points& points, uint32_t end, float weight, Vec3f tip);
  void remove(uint32_t number);
  /// Replaces the vertices of a chain by as many others of the same places.
  void relight(uint32_t number, std::span<const Vertex> vertices);
  void clear();

  std::span<const Vertex> vertices(uint32_t number) const {
    return {&vertices_[chains_[number].first], chains_[number].count};
  }
  std::span<const Place> places(uint32_t number) const {
    return {&places_[chains_[number].first], chains_[number].count};
  }
  /// Of each vertex; empty if all of all chains are 1.
  std::span<const Tint> tints(uint32_t number) const {
    if (!tints_.size()) return {};
    return {&tints_[chains_[number].first], chains_[number].count};
  }
  Points points(uint32_t number) const { return {vertices(number), places(number), tints(number)}; }
  bool has_tints() const { return tints_.size(); }
  /// Where the last segment ends, see Chain::tip.
  Vec3f tip(uint32_t number) const { return tips_[number]; }
  void prefetch_tip(uint32_t number) const { __builtin_prefetch(&tips_[number]); }
  /// Calls visit(point) for the points between the segments of the chain.
  template <class Visit>
  void each_bend(uint32_t number, const Visit& visit) const {
    const std::span<const Vertex> own = vertices(number);
    for (size_t k = 0; k < own.size(); ++k)
      if (!own[k].is_of_end()) visit(places_[chains_[number].first + k].point());
  }
  /// Fetches what prefetch_vertices() reads, so that it needs not wait for memory; and what readers
  /// of the vertices do.
  void prefetch(uint32_t number) const {
    __builtin_prefetch(&chains_[number]);
    __builtin_prefetch(&sent_[number].end);
  }
  void prefetch_vertices(uint32_t number) const {
    __builtin_prefetch(&vertices_[chains_[number].first]);
    __builtin_prefetch(&places_[chains_[number].first]);
  }
  /// Whether a chain brings what one of these vertices, tints, end and weight would.
  bool is(uint32_t number, const Points& points, uint32_t end, float weight) const;
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
  static constexpr size_t kBytes = sizeof(Range) + sizeof(Sent) + sizeof(Vec3f);
  static constexpr size_t kVertexBytes = sizeof(Vertex) + sizeof(Place);
  /// of a vertex of this pool
  size_t vertex_bytes() const { return kVertexBytes + (has_tints() ? sizeof(Tint) : 0); }
  /// As computed by the last paint().
  const Sent& sent(uint32_t number) const { return sent_[number]; }
  /// Recomputes the light of all chains if `paint` changed.
  void paint(const Paint& paint, const Workers& workers);
  size_t size() const { return chains_.size() - free_.size(); }
  /// Number of vertices of all chains, including some of removed chains.
  size_t vertex_count() const { return vertices_.size(); }
  size_t bytes() const;

 private:
  void send(uint32_t number, const Paint& paint);
  void add_gap(size_t length);
  void write_tints(size_t first, std::span<const Tint> tints);

  Paint paint_;           // without materials: paint() was not called yet
  Chunks<Range> chains_;  // storage of each chain in vertices_
  // By chain; stored separately, since evaluation reads nothing else.
  Chunks<Sent> sent_;
  Chunks<Vec3f> tips_;  // by chain
  std::vector<uint32_t> free_;
  // The vertices of a chain are contiguous, and so are their places and tints, at the same indices.
  Chunks<Vertex> vertices_;
  Chunks<Place> places_;
  Chunks<Tint> tints_;  // empty before one of them is not 1
  // free storage in vertices_, by length
  std::array<std::vector<uint32_t>, kMaxVertices + 1> gaps_;
};

}  // namespace deltalux::gather
