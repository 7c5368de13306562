// SPDX-License-Identifier: Apache-2.0
// Interpolates in linear light: means of sRGB values would be too dark.
#include "surfaces/texture.h"

#include <algorithm>
#include <cmath>

#include "base/assertion.h"

namespace deltalux::surfaces {
namespace {

/// What bytes stand for: linear values of sRGB (IEC 61966-2-1), and shares of 255.
struct Tables {
  std::array<float, 256> linear, share;
  Tables() {
    for (size_t i = 0; i < linear.size(); ++i) {
      const double s = double(i) / 255;
      linear[i] = float(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
      share[i] = float(s);
    }
  }
};
const Tables kTables;

/// The two texels of a row or column around a coordinate, and the share of the second.
struct Between {
  size_t first, second;
  float share;
};

inline Between between(float at, uint32_t count, Wrap wrap, bool nearest) {
  // Rounding may take a coordinate to the very end, 1.
  const auto last = int64_t(count) - 1;
  float place = wrapped(at, wrap) * float(count);
  if (nearest) {
    const size_t own = size_t(std::min(int64_t(place), last));
    return {own, own, 0};
  }
  place -= 0.5f;
  const float below = std::floor(place);
  int64_t first = int64_t(below), second = first + 1;
  if (wrap == Wrap::repeat) {
    first = first < 0 ? last : first, second = second > last ? 0 : second;
  } else {
    first = std::max<int64_t>(first, 0), second = std::min(second, last);
  }
  return {size_t(first), size_t(second), place - below};
}

Texture::Weighted mixed(const Texture::Weighted& a, const Texture::Weighted& b, float share) {
  return {a.colour * (1 - share) + b.colour * share, a.weight * (1 - share) + b.weight * share};
}

}  // namespace

Texture::Texture(uint32_t width, uint32_t height, std::span<const Texel> texels)
    : width_(width), height_(height), across_((width + kEdge - 1) / kEdge) {
  DELTALUX_ASSERT(width_ && height_ && texels.size() == size_t(width_) * height_);
  tiles_.resize(across_ * ((height_ + kEdge - 1) / kEdge));
  Texel most{};
  uint8_t least = 255;
  for (size_t row = 0; row < height_; ++row)
    for (size_t column = 0; column < width_; ++column) {
      const Texel& own = texels[row * width_ + column];
      tiles_[tile(column, row)].texel[in_tile(column, row)] = own;
      for (size_t c = 0; own[3] && c < 3; ++c) most[c] = std::max(most[c], own[c]);
      least = std::min(least, own[3]);
    }
  least_weight_ = kTables.share[least];
  brightest_ = {kTables.linear[most[0]], kTables.linear[most[1]], kTables.linear[most[2]]};
}

Texture::Weighted Texture::texel(size_t column, size_t row) const {
  const Texel& own = tiles_[tile(column, row)].texel[in_tile(column, row)];
  const std::array<float, 256>& linear = kTables.linear;
  const float weight = kTables.share[own[3]];
  return {Vec3f{linear[own[0]], linear[own[1]], linear[own[2]]} * weight, weight};
}

void Texture::fetch(float u, float v, const Sampler& sampler) const {
  const Between x = between(u, width_, sampler.wrap[0], sampler.nearest),
                y = between(v, height_, sampler.wrap[1], sampler.nearest);
  const size_t first = tile(x.first, y.first), last = tile(x.second, y.second);
  __builtin_prefetch(&tiles_[first]);
  if (first == last) return;
  __builtin_prefetch(&tiles_[last]);
  __builtin_prefetch(&tiles_[tile(x.second, y.first)]);
  __builtin_prefetch(&tiles_[tile(x.first, y.second)]);
}

Texture::Weighted Texture::at(float u, float v, const Sampler& sampler) const {
  const Between x = between(u, width_, sampler.wrap[0], sampler.nearest),
                y = between(v, height_, sampler.wrap[1], sampler.nearest);
  return mixed(mixed(texel(x.first, y.first), texel(x.second, y.first), x.share),
               mixed(texel(x.first, y.second), texel(x.second, y.second), x.share), y.share);
}

const Mipmap& Texture::mipmap() const {
  std::call_once(lazy_->once, [&] {
    lazy_->mipmap.emplace(width_, height_,
                          [&](size_t column, size_t row) { return texel(column, row).colour; });
  });
  return *lazy_->mipmap;
}

}  // namespace deltalux::surfaces
