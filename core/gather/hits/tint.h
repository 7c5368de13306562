// SPDX-License-Identifier: Apache-2.0
// Tints of points of chains in four bytes each, as scenes with textures have one for every point.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>

#include "base/vec.h"

namespace deltalux::gather {

/// The tint of a point, see surfaces::Kind::tint(), with 9 bits per channel and a common exponent
/// of 5 bits (the format of OpenGL's RGB9_E5): exact to 1/512 of the largest channel.
class Tint {
 public:
  static constexpr float kMost = 65408;
  /// 1 in all channels.
  constexpr Tint() = default;
  /// The nearest one. `value`: not negative; up to kMost, or that counts.
  static Tint of(Vec3f value) {
    Tint out;
    if (value == Vec3f{1, 1, 1}) return out;
    value = min(value, Vec3f{kMost, kMost, kMost});
    const float most = std::max({value.x, value.y, value.z, kLeast});
    int exponent = int(std::bit_cast<uint32_t>(most) >> 23) - 126;  // most < 2^exponent
    if (steps(most, exponent) == 1u << kBits) ++exponent;
    out.bits_ = uint32_t(exponent + kBias) << (3 * kBits);
    for (int c = 0; c < 3; ++c) out.bits_ |= steps(value[c], exponent) << (kBits * c);
    return out;
  }
  Vec3f value() const {
    const float unit = power_of_two(int(bits_ >> (3 * kBits)) - kBias - kBits);
    Vec3f out;
    for (int c = 0; c < 3; ++c) out[c] = float(bits_ >> (kBits * c) & kMask) * unit;
    return out;
  }
  constexpr uint32_t bits() const { return bits_; }
  friend constexpr bool operator==(Tint, Tint) = default;

 private:
  static constexpr int kBits = 9, kBias = 15;
  static float power_of_two(int exponent) {
    return std::bit_cast<float>(uint32_t(127 + exponent) << 23);
  }
  /// In units of 2^(exponent - kBits), rounded.
  static uint32_t steps(float value, int exponent) {
    return uint32_t(value * power_of_two(kBits - exponent) + 0.5f);
  }
  static constexpr uint32_t kMask = (1u << kBits) - 1;
  static constexpr float kLeast = 0x1p-15f;
  uint32_t bits_ =
      uint32_t(1 + kBias) << (3 * kBits) | 0x100u << (2 * kBits) | 0x100u << kBits | 0x100u;
};

}  // namespace deltalux::gather
