// SPDX-License-Identifier: Apache-2.0
// Stores chains compactly: gaps are reused by chains of the same length.
#include "gather/hits/chain_pool.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/error.h"

namespace deltalux::gather {

uint32_t ChainPool::add(const Points& points, uint32_t end, float weight, Vec3f tip) {
  const std::span<const Vertex> vertices = points.vertices;
  constexpr size_t kMaxChains = size_t(1) << 30;
  if (free_.empty()) {
    if (chains_.size() >= kMaxChains - 1)
      throw OptionError("gather: more than 1e9 rays meet something near, expected fewer rays");
    free_.reserve(1);
    tips_.grow(1), sent_.grow(1), chains_.grow(1);
    free_.push_back(uint32_t(chains_.size() - 1));
  }
  std::vector<uint32_t>& gaps = gaps_[vertices.size()];
  if (gaps.empty()) {
    const size_t room = Chunks<Vertex>::kChunk - vertices_.size() % Chunks<Vertex>::kChunk;
    if (room < vertices.size()) add_gap(room);
    add_gap(vertices.size());
  }
  write_tints(gaps.back(), points.tints);
  const uint32_t number = free_.back();
  chains_[number] = {gaps.back(), uint32_t(vertices.size())};
  tips_[number] = tip;
  std::copy(vertices.begin(), vertices.end(), &vertices_[gaps.back()]);
  std::copy(points.places.begin(), points.places.end(), &places_[gaps.back()]);
  sent_[number] = {{}, {}, end, weight};
  if (!paint_.reflectance.empty()) send(number, paint_);
  gaps.pop_back();
  free_.pop_back();
  return number;
}

void ChainPool::write_tints(size_t first, std::span<const Tint> tints) {
  const bool plain =
      std::all_of(tints.begin(), tints.end(), [](Tint own) { return own == Tint{}; });
  if (!tints_.size() && plain) return;
  if (tints_.size() < vertices_.size()) tints_.grow(vertices_.size() - tints_.size());
  DELTALUX_ASSERT(!tints.empty());
  std::copy(tints.begin(), tints.end(), &tints_[first]);
}

void ChainPool::add_gap(size_t length) {
  if (vertices_.size() + length > std::numeric_limits<uint32_t>::max())
    throw OptionError("gather: chains of rays have more than 4e9 vertices, expected fewer rays");
  std::vector<uint32_t>& gaps = gaps_[length];
  gaps.reserve(gaps.size() + 1);
  places_.grow(length);
  vertices_.grow(length);
  gaps.push_back(uint32_t(vertices_.size() - length));
}

bool ChainPool::is(uint32_t number, const Points& own, uint32_t end, float weight) const {
  const Points stored = points(number);
  const auto same = [&](size_t k) {
    const Tint one = stored.tints.empty() ? Tint{} : stored.tints[k];
    const Tint other = own.tints.empty() ? Tint{} : own.tints[k];
    return stored.vertices[k] == own.vertices[k] && one == other;
  };
  size_t k = 0;
  if (stored.size() != own.size()) return false;
  while (k < own.size() && same(k)) ++k;
  return k == own.size() && sent_[number].end == end && sent_[number].weight == weight;
}

void ChainPool::relight(uint32_t number, std::span<const Vertex> vertices) {
  std::copy(vertices.begin(), vertices.end(), &vertices_[chains_[number].first]);
  if (!paint_.reflectance.empty()) send(number, paint_);
}

void ChainPool::remove(uint32_t number) {
  gaps_[chains_[number].count].push_back(chains_[number].first);
  free_.push_back(number);
}

void ChainPool::clear() {
  chains_.clear(), sent_.clear(), tips_.clear(), free_.clear();
  vertices_.clear(), places_.clear(), tints_.clear();
  for (auto& gaps : gaps_) gaps.clear();
}

void ChainPool::paint(const Paint& paint, const Workers& workers) {
  if (paint == paint_) return;
  Paint own = paint;
  paint_ = {};  // stays empty if something fails below
  workers.for_blocks(chains_.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) send(uint32_t(i), own);
  });
  paint_ = std::move(own);
}

void ChainPool::send(uint32_t number, const Paint& paint) {
  Sent& out = sent_[number];
  if (!chains_[number].count) return;  // the chain's storage is free
  out.direct = {0, 0, 0}, out.through = {1, 1, 1};
  Vec3f factor{1, 1, 1};  // of lobes, and of the points before this one by their tints
  uint32_t touched = 0;   // points before this one
  const Points own = points(number);
  for (size_t k = 0; k < own.size(); ++k) {
    const Vertex& vertex = own.vertices[k];
    if (vertex.is_factor()) {
      factor = Vertex::bounded(surfaces::product(factor, vertex.factor()));
      continue;
    }
    Vec3f here = factor;
    if (!own.tints.empty() && own.tints[k] != Tint{})
      here = Vertex::bounded(
          surfaces::product(factor, paint.contrasted(vertex.material_index(), own.tints[k])));
    const Vec3f reflectance = paint.reflectance[vertex.material_index()];
    // The probability of continuation divides what comes from beyond the vertex, not the vertex's
    // own light.
    const float goes_on = touched < kSurely ? 1.0f : 1 / kGoesOn;
    touched += vertex.is_point();
    const Vec3f light =
        vertex.is_caustic() ? paint.caustic(vertex.light) : paint.of_lamp(vertex.light);
    const float lit = vertex.weight * vertex.direct;
    for (size_t c = 0; c < 3; ++c) {
      const float sent = out.through[c] * reflectance[int(c)];
      out.direct[c] += sent * (here[int(c)] * (lit * light[int(c)]));
      if (vertex.is_point()) out.through[c] = sent * goes_on;
    }
    if (vertex.is_point()) factor = here;
  }
  for (size_t c = 0; c < 3; ++c) out.through[c] *= out.weight * factor[int(c)];
}

size_t ChainPool::bytes() const {
  size_t sum = chains_.bytes() + sent_.bytes() + tips_.bytes() + vertices_.bytes() +
               places_.bytes() + tints_.bytes() + free_.capacity() * sizeof(uint32_t);
  for (const auto& gaps : gaps_) sum += gaps.capacity() * sizeof(uint32_t);
  return sum;
}

}  // namespace deltalux::gather
