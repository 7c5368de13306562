// SPDX-License-Identifier: Apache-2.0
// The fixed directions of samples' gather rays.
#pragma once
#include <array>
#include <cstring>
#include <vector>

#include "base/cone.h"
#include "base/hemisphere.h"
#include "base/random.h"

namespace deltalux::gather {

/// Cosine-distributed directions from Sobol' points, with a random digital shift for each sample,
/// so that each square stratum holds equally many directions of every sample.
class Directions {
 public:
  /// For samples that cast at most `count` rays each.
  Directions(uint32_t count, uint64_t seed);
  /// Direction of ray `ray` of the sample with key `sample`, about the unit normal `n`.
  Vec3f operator()(uint64_t sample, uint32_t ray, Vec3f n) const {
    const auto [u, v] = shifted(ray, combine(key_, sample));
    return cosine_direction(n, u, v);
  }
  /// Point `number` of another sequence of that sample, `stream` > 0, in the unit square.
  std::array<float, 2> point(uint64_t sample, uint32_t stream, uint32_t number) const {
    return shifted(number, combine(combine(key_, sample), stream));
  }

  /// Two more dimensions of either sequence (stream 0: that of the rays), for what happens where a
  /// ray lands.
  std::array<float, 2> beyond(uint64_t sample, uint32_t stream, uint32_t number) const {
    const uint64_t shift = combine(combine(key_, sample), ~uint64_t(stream));
    const auto& p = points_[number];
    return {unit_float32(sobol::owen_scramble(p[2], uint32_t(shift))),
            unit_float32(sobol::owen_scramble(p[3], uint32_t(shift >> 32)))};
  }

  /// Calls visit(ray) for those of the first `count` rays of `sample`, about normal `n`, that may
  /// meet the ball, and for a few others.
  template <class Visit>
  void each_towards(uint64_t sample, uint32_t count, Vec3f n, Vec3f to_centre, float radius,
                    const Visit& visit) const {
    const float distance = length(to_centre);
    const bool inside = !(distance > radius);
    const Vec3f towards = inside ? n : to_centre * (1 / distance);
    const float sine = inside ? 1.0f : radius / distance;
    const float cosine = std::sqrt(std::max(0.0f, 1 - sine * sine));
    Vec3f u, v;
    tangent_frame(n, u, v);
    const Vec3f local{dot(towards, u), dot(towards, v), dot(towards, n)};
    const uint64_t shift = combine(key_, sample);
    const uint32_t turned_u = uint32_t(shift) >> (32 - kBits);
    const uint32_t turned_v = uint32_t(shift >> 32) >> (32 - kBits);
    if (inside) {
      for (uint32_t ray = 0; ray < count; ++ray) visit(ray);
      return;
    }
    const Strata& all = strata();
    std::array<uint8_t, kStrata> near;
    for (uint32_t i = 0; i < kStrata; ++i)  // without branches, so that the compiler uses SIMD
      near[i] = all.x[i] * local.x + all.y[i] * local.y + all.z[i] * local.z >=
                all.cosine[i] * cosine - all.sine[i] * sine - Cone::kMargin;
    constexpr uint32_t kTogether = sizeof(uint64_t);
    for (uint32_t first = 0; first < kStrata; first += kTogether) {
      uint64_t some;
      std::memcpy(&some, &near[first], kTogether);
      for (uint32_t i = first; some && i < first + kTogether; ++i) {
        if (!near[i]) continue;
        const uint32_t own = ((i / kSide) ^ turned_v) * kSide + ((i % kSide) ^ turned_u);
        // Rays of a stratum are in ascending order.
        for (uint32_t k = first_[own]; k < first_[own + 1] && rays_[k] < count; ++k)
          visit(rays_[k]);
      }
    }
  }

 private:
  // log2 of the number of strata along each side, and that number
  static constexpr uint32_t kBits = 4, kSide = 1u << kBits, kStrata = kSide * kSide;
  /// A cone around all directions of each stratum, about +z: as of Cone.
  struct Strata {
    alignas(64) std::array<float, kStrata> x, y, z, cosine, sine;
    Strata();
  };
  static const Strata& strata() {
    static const Strata all;
    return all;
  }
  std::array<float, 2> shifted(uint32_t number, uint64_t shift) const {
    const auto& p = points_[number];
    return {unit_float32(p[0] ^ uint32_t(shift)), unit_float32(p[1] ^ uint32_t(shift >> 32))};
  }

  uint64_t key_;
  std::vector<std::array<uint32_t, 4>> points_;
  std::vector<uint32_t> rays_;                 // sorted by the stratum of their points
  std::array<uint32_t, kStrata + 1> first_{};  // of each stratum, in rays_
};

}  // namespace deltalux::gather
