// SPDX-License-Identifier: Apache-2.0
// A few rays from each place, until enough of them are free.
#include "samples/covered_places.h"

#include <array>
#include <cmath>

namespace deltalux::samples {
namespace {

constexpr size_t kGrain = 256;
constexpr int kDirections = 12;
constexpr int kNeeded = 3;  // free rays; where two boxes touch, one may seem so
constexpr float kGoldenAngle = 2.399963f;
constexpr float kSamePlace = 1e-4f;  // of a distance: both sides of a sheet differ by rounding

/// Directions around +z, distributed as the cosine, in no order of height.
std::array<Vec3f, kDirections> directions() {
  std::array<Vec3f, kDirections> out;
  for (int i = 0; i < kDirections; ++i) {
    const float share = (float(i) + 0.5f) / kDirections, across = std::sqrt(share);
    const float turn = kGoldenAngle * float(i);
    out[size_t(i)] = {across * std::cos(turn), across * std::sin(turn), std::sqrt(1 - share)};
  }
  return out;
}

/// Whether the ray meets nothing, or a side that light may reach farther than `contact`.
bool is_free(Layers layers, Vec3f origin, Vec3f w, float contact) {
  trace::Hit nearest;
  bool facing = false;
  for (const trace::RayCaster* layer : layers) {
    const trace::Hit hit = layer->closest(origin, w);
    if (!hit.valid()) continue;
    const bool own = dot(hit.normal, w) < 0;
    if (nearest.valid() && std::fabs(hit.t - nearest.t) <= kSamePlace * nearest.t) {
      facing |= own;
    } else if (hit.t < nearest.t) {
      nearest = hit;
      facing = own;
    }
  }
  return !nearest.valid() || (facing && nearest.t > contact);
}

}  // namespace

std::vector<uint8_t> covered_places(Layers layers, std::span<const Vec3f> origins,
                                    std::span<const Vec3f> normals, float contact,
                                    const Workers& workers) {
  static const std::array<Vec3f, kDirections> around = directions();
  std::vector<uint8_t> covered(origins.size());
  workers.for_blocks(origins.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      int free = 0;
      for (int k = 0; k < kDirections && free < kNeeded && free + kDirections - k >= kNeeded; ++k)
        free += is_free(layers, origins[i], turned(around[size_t(k)], normals[i]), contact);
      covered[i] = free < kNeeded;
    }
  });
  return covered;
}

}  // namespace deltalux::samples
