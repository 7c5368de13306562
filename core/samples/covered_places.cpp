// SPDX-License-Identifier: Apache-2.0
// Casts a few rays from each place, until enough of them are unblocked.
#include "samples/covered_places.h"

#include <array>
#include <cmath>

namespace deltalux::samples {
namespace {

constexpr size_t kGrain = 256;
constexpr int kDirections = 12;
// unblocked rays needed; where two boxes touch, one ray may seem unblocked
constexpr int kNeeded = 3;
constexpr float kGoldenAngle = 2.399963f;
// relative to the distance: hits on the two sides of a sheet differ by rounding
constexpr float kSamePlace = 1e-4f;

/// Cosine-distributed directions around +z, in an order that is not sorted by height.
std::array<Vec3f, kDirections> directions() {
  std::array<Vec3f, kDirections> out;
  for (int i = 0; i < kDirections; ++i) {
    const float share = (float(i) + 0.5f) / kDirections, across = std::sqrt(share);
    const float turn = kGoldenAngle * float(i);
    out[size_t(i)] = {across * std::cos(turn), across * std::sin(turn), std::sqrt(1 - share)};
  }
  return out;
}

/// Whether the ray hits nothing, or hits the front of a surface farther away than `contact`.
bool is_free(Layers layers, Vec3f origin, Vec3f w, float contact) {
  trace::Hit nearest;
  bool facing = false;
  for (const trace::EmbreeScene* layer : layers) {
    // Search a little beyond the nearest hit: the other side of a sheet may be there.
    const trace::Hit hit = layer->closest(0, origin, w, 0, nearest.t * (1 + 2 * kSamePlace));
    if (!hit.valid()) continue;
    const bool own = dot(hit.normal, w) < 0;
    if (nearest.valid() && std::fabs(hit.t - nearest.t) <= kSamePlace * nearest.t) {
      facing |= own;
    } else if (hit.t < nearest.t) {
      nearest = hit;
      facing = own;
    }
    if (nearest.t <= contact) return false;  // further layers can only find nearer hits
  }
  return !nearest.valid() || facing;
}

}  // namespace

std::vector<uint8_t> covered_places(Layers layers, std::span<const Vec3f> origins,
                                    std::span<const Vec3f> normals, float contact,
                                    const Workers& workers) {
  static const std::array<Vec3f, kDirections> around = directions();
  std::vector<uint8_t> covered(origins.size());
  workers.for_blocks(origins.size(), kGrain, [&](size_t begin, size_t end) {
    // Trace all places of a block in the same direction, then in the next: the rays are coherent.
    std::array<int, kGrain> free{};
    for (int k = 0; k < kDirections; ++k)
      for (size_t i = begin; i < end; ++i) {
        int& own = free[i - begin];
        if (own < kNeeded && own + kDirections - k >= kNeeded)
          own += is_free(layers, origins[i], turned(around[size_t(k)], normals[i]), contact);
      }
    for (size_t i = begin; i < end; ++i) covered[i] = free[i - begin] < kNeeded;
  });
  return covered;
}

}  // namespace deltalux::samples
