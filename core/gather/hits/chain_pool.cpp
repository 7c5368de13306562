// SPDX-License-Identifier: Apache-2.0
// Stores chains compactly: gaps are reused by chains of the same length.
#include "gather/hits/chain_pool.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/error.h"

namespace deltalux::gather {

uint32_t ChainPool::add(std::span<const Vertex> vertices, uint32_t end, float weight,
                        const trace::Footprint& footprint) {
  constexpr size_t kMaxChains = size_t(1) << 31;
  if (free_.empty()) {
    if (chains_.size() >= kMaxChains - 1)
      throw OptionError("gather: more than 2e9 rays meet something near, expected fewer rays");
    free_.reserve(1);
    footprints_.grow(1), sent_.grow(1), chains_.grow(1);
    free_.push_back(uint32_t(chains_.size() - 1));
  }
  std::vector<uint32_t>& gaps = gaps_[vertices.size()];
  if (gaps.empty()) {
    const size_t room = Chunks<Vertex>::kChunk - vertices_.size() % Chunks<Vertex>::kChunk;
    if (room < vertices.size()) add_gap(room);
    add_gap(vertices.size());
  }
  const uint32_t number = free_.back();
  chains_[number] = {gaps.back(), uint32_t(vertices.size())};
  footprints_[number] = footprint;
  std::copy(vertices.begin(), vertices.end(), &vertices_[gaps.back()]);
  sent_[number] = {{}, {}, end, weight};
  if (!paint_.reflectance.empty()) send(number, paint_);
  gaps.pop_back();
  free_.pop_back();
  return number;
}

void ChainPool::add_gap(size_t length) {
  if (vertices_.size() + length > std::numeric_limits<uint32_t>::max())
    throw OptionError("gather: chains of rays have more than 4e9 vertices, expected fewer rays");
  std::vector<uint32_t>& gaps = gaps_[length];
  gaps.reserve(gaps.size() + 1);
  vertices_.grow(length);
  gaps.push_back(uint32_t(vertices_.size() - length));
}

bool ChainPool::is(uint32_t number, std::span<const Vertex> own, uint32_t end, float weight) const {
  const std::span<const Vertex> stored = vertices(number);
  return std::equal(stored.begin(), stored.end(), own.begin(), own.end()) &&
         sent_[number].end == end && sent_[number].weight == weight;
}

void ChainPool::remove(uint32_t number) {
  gaps_[chains_[number].count].push_back(chains_[number].first);
  free_.push_back(number);
}

void ChainPool::clear() {
  chains_.clear(), sent_.clear(), footprints_.clear(), free_.clear(), vertices_.clear();
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
  const std::span<const Vertex> own = vertices(number);
  uint32_t touched = 0;  // points before this one
  for (const Vertex& vertex : own) {
    if (vertex.is_tint()) {
      for (size_t c = 0; c < 3; ++c) out.through[c] *= vertex.direct[c];
      continue;
    }
    const bool is_point = !vertex.is_of_end() && !vertex.is_caustic();
    const Vec3f reflectance = paint.reflectance[vertex.material_index()];
    // The probability of continuation divides what comes from beyond the vertex, not the vertex's
    // own light.
    const float goes_on = touched < kSurely ? 1.0f : 1 / kGoesOn;
    touched += is_point;
    const float dim = paint.dim[std::min<size_t>(vertex.lamp(), paint.dim.size() - 1)];
    for (size_t c = 0; c < 3; ++c) {
      const float sent = out.through[c] * reflectance[int(c)];
      const float light = vertex.is_caustic() ? paint.caustic(vertex.light, c) : dim;
      out.direct[c] += sent * vertex.direct[c] * light;
      if (is_point) out.through[c] = sent * goes_on;
    }
  }
  for (float& through : out.through) through *= out.weight;
}

size_t ChainPool::bytes() const {
  size_t sum = chains_.bytes() + sent_.bytes() + footprints_.bytes() + vertices_.bytes() +
               free_.capacity() * sizeof(uint32_t);
  for (const auto& gaps : gaps_) sum += gaps.capacity() * sizeof(uint32_t);
  return sum;
}

}  // namespace deltalux::gather
