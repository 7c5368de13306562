// SPDX-License-Identifier: Apache-2.0
// The fixed directions of samples' gather rays.
#pragma once
#include <array>
#include <span>
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
    for (uint32_t i = 0; i < kSide * kSide; ++i) {
      const Cone& cone = cones()[i];
      if (!inside && dot(cone.axis, local) < cone.limit(cosine, sine)) continue;
      const uint32_t own = ((i / kSide) ^ turned_v) * kSide + ((i % kSide) ^ turned_u);
      // Rays of a stratum are in ascending order.
      for (uint32_t ray : std::span(rays_).subspan(first_[own], first_[own + 1] - first_[own])) {
        if (ray >= count) break;
        visit(ray);
      }
    }
  }

 private:
  // log2 of the number of strata along each side, and that number
  static constexpr uint32_t kBits = 3, kSide = 1u << kBits;
  /// A cone around all directions of each stratum, about +z.
  static std::array<Cone, kSide * kSide> make_cones();
  static const std::array<Cone, kSide * kSide>& cones() {
    static const std::array<Cone, kSide * kSide> all = make_cones();
    return all;
  }
  std::array<float, 2> shifted(uint32_t number, uint64_t shift) const {
    const auto& p = points_[number];
    return {unit_float32(p[0] ^ uint32_t(shift)), unit_float32(p[1] ^ uint32_t(shift >> 32))};
  }

  uint64_t key_;
  std::vector<std::array<uint32_t, 4>> points_;
  std::vector<uint32_t> rays_;                       // sorted by the stratum of their points
  std::array<uint32_t, kSide * kSide + 1> first_{};  // of each stratum, in rays_
};

}  // namespace deltalux::gather
