// SPDX-License-Identifier: Apache-2.0
// Divides a mesh into parts whose boxes hold less space than one box around all of it.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace deltalux::trace {

/// Which triangles belong to which part; it stays the same wherever the mesh is.
class Parts {
 public:
  static constexpr size_t kMost = 8;

  /// Divides so that the boxes have the least surface, which is the chance that a random line meets
  /// them (as for bounding volume hierarchies: Goldsmith & Salmon 1987, IEEE CG&A 7(5)).
  Parts(std::span<const Vec3f> vertices, std::span<const std::array<uint32_t, 3>> triangles);

  size_t count() const { return count_; }
  /// The box of each part, with the vertices where they are now.
  std::vector<Box> boxes(std::span<const Vec3f> vertices,
                         std::span<const std::array<uint32_t, 3>> triangles) const;

 private:
  size_t count_ = 0;
  std::vector<uint8_t> part_;  // by triangle
};

}  // namespace deltalux::trace
