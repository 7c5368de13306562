// SPDX-License-Identifier: Apache-2.0
// Encodes directions in 4 bytes (octahedral, 16+16 bits). Rays are traced along the decoded
// direction, so that reading a segment back loses nothing.
#pragma once
#include <cmath>
#include <cstdint>

#include "base/vec.h"

namespace deltalux {

/// Decodes a unit vector (Cigolle et al. 2014, JCGT 3(2)).
inline Vec3f decode_direction(uint32_t code) {
  const float x = float(int32_t(code & 0xffffu) - 32767) * (1.0f / 32767.0f);
  const float y = float(int32_t(code >> 16) - 32767) * (1.0f / 32767.0f);
  Vec3f v{x, y, 1.0f - std::fabs(x) - std::fabs(y)};
  if (v.z < 0) {
    v.x = (1.0f - std::fabs(y)) * (x >= 0 ? 1.0f : -1.0f);
    v.y = (1.0f - std::fabs(x)) * (y >= 0 ? 1.0f : -1.0f);
  }
  return v * (1.0f / std::sqrt(dot(v, v)));
}

inline uint32_t encode_direction(Vec3f d) {
  const float inverse = 1.0f / (std::fabs(d.x) + std::fabs(d.y) + std::fabs(d.z));
  float x = d.x * inverse, y = d.y * inverse;
  if (d.z < 0) {
    const float folded = (1.0f - std::fabs(y)) * (x >= 0 ? 1.0f : -1.0f);
    y = (1.0f - std::fabs(x)) * (y >= 0 ? 1.0f : -1.0f);
    x = folded;
  }
  const auto code = [](float v) {
    return uint32_t(std::min(65534.0f, std::max(0.0f, std::floor(v * 32767.0f + 32767.5f))));
  };
  return code(x) | (code(y) << 16);
}

}  // namespace deltalux
