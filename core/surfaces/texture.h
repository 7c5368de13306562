// SPDX-License-Identifier: Apache-2.0
// Textures: the reflectance of each point of a surface, from the texels of an image.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"
#include "surfaces/mipmap.h"

namespace deltalux::surfaces {

/// What continues an image beyond its edges: copies of it, its border, or mirrored copies.
enum class Wrap : uint8_t { repeat, clamp, mirror };

/// The coordinate in [0, 1] that one beyond an image's edges stands for.
template <class T>
T wrapped(T at, Wrap wrap) {
  if (wrap == Wrap::repeat) {
    at -= std::floor(at);
  } else if (wrap == Wrap::mirror) {
    at -= 2 * std::floor(T(0.5) * at);
    at = std::min(at, 2 - at);
  }
  return std::clamp(at, T(0), T(1));
}

/// How an image is read beside the centres of its texels, and beyond its edges.
struct Sampler {
  std::array<Wrap, 2> wrap{};  ///< along u and v
  bool nearest = false;        ///< else bilinear
};

/// An image of sRGB texels. Surfaces share it.
class Texture {
 public:
  /// Three channels, and how much it counts, from 0 to 255.
  using Texel = std::array<uint8_t, 4>;
  /// A linear colour times how much it counts, and how much that is, up to 1.
  struct Weighted {
    Vec3f colour{};
    float weight = 0;
  };
  /// `texels`: width × height, at least one, row by row from the top left.
  Texture(uint32_t width, uint32_t height, std::span<const Texel> texels);
  /// The texel at (u, v); (0, 0) is the upper left corner of the image, (1, 1) the lower right one.
  Weighted at(float u, float v, const Sampler& sampler) const;
  /// Begins to bring these texels into the cache.
  void fetch(float u, float v, const Sampler& sampler) const;
  /// The linear maximum over all texels that count, per channel.
  Vec3f brightest() const { return brightest_; }
  /// The least of how much texels count.
  float least_weight() const { return least_weight_; }
  uint32_t width() const { return width_; }
  uint32_t height() const { return height_; }
  /// Made when it is first asked for; thread-safe.
  const Mipmap& mipmap() const;
  size_t bytes() const {
    return tiles_.capacity() * sizeof(Tile) + (lazy_->mipmap ? lazy_->mipmap->bytes() : 0);
  }

 private:
  static constexpr size_t kEdge = 4;
  /// Neighbouring texels in one cache line: most of the time of a look-up is spent on memory.
  struct alignas(64) Tile {
    Texel texel[kEdge * kEdge];
  };
  size_t tile(size_t column, size_t row) const { return row / kEdge * across_ + column / kEdge; }
  static size_t in_tile(size_t column, size_t row) { return row % kEdge * kEdge + column % kEdge; }
  Weighted texel(size_t column, size_t row) const;

  uint32_t width_, height_;
  size_t across_;  // tiles in a row of them
  std::vector<Tile> tiles_;
  Vec3f brightest_{};
  float least_weight_ = 1;
  /// What is made on demand.
  struct Lazy {
    std::once_flag once;
    std::optional<const Mipmap> mipmap;
  };
  std::shared_ptr<Lazy> lazy_ = std::make_shared<Lazy>();
};

/// How a texture lies on a surface, and what its texels mean there.
struct TextureMap {
  std::shared_ptr<const Texture> texture;
  /// Takes a surface's coordinates (u, v, 1) to those in the image.
  std::array<std::array<float, 3>, 2> matrix{{{1, 0, 0}, {0, 1, 0}}};
  Sampler sampler{};
  /// 1 / the mean texel where the surface has its mean reflectance; 0 for a channel that is black
  /// there, so that the texels do not count.
  Vec3f gain{1, 1, 1};
  /// Whether the surface has holes where texels count less than half.
  bool cut_out = false;
};

}  // namespace deltalux::surfaces
