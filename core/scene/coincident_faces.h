// SPDX-License-Identifier: Apache-2.0
// Finds faces of one body that lie in the same place, and tells which of them is seen there.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace deltalux::scene {

/// In metres: sheets that are nearer to each other shine as one, and are lit as one.
inline constexpr float kSheet = 1.5e-4f;

/// A triangle, with what decides which of several in one place is seen.
struct Face {
  Vec3f corner[3];
  bool emits = false;
  bool two_sided = false;  ///< of a face that emits
  bool opaque = true;      ///< a face that lets rays pass hides none
  Vec3f normal() const {
    return Vec3f(normalize(cross(Vec3d(corner[1] - corner[0]), Vec3d(corner[2] - corner[0]))));
  }
};

/// A face hides another where it lies above it, however little. Where both lie in one plane, up to
/// the rounding of rays, it hides the other from a side if it shows its front there and the other
/// does not; else if only it emits; else if only it emits to both sides; else if it comes first.
class CoincidentFaces {
 public:
  /// A face that hides some part of another.
  struct Hider {
    uint32_t face;
    float gap;       ///< how far it lies above the other; 0 if in its plane
    bool from_back;  ///< from which side of the other one
  };

  CoincidentFaces() = default;
  /// Finds all pairs of faces that overlap and are at most `within` apart, and no farther than the
  /// smaller one is long.
  CoincidentFaces(std::span<const Face> faces, float within);

  bool empty() const { return hiders_.empty(); }
  /// Those that hide a part of a face, in the order of faces.
  std::span<const Hider> of(uint32_t face) const {
    if (empty()) return {};
    return std::span(hiders_).subspan(begin_[face], begin_[face + 1] - begin_[face]);
  }
  size_t bytes() const {
    return begin_.capacity() * sizeof(uint32_t) + hiders_.capacity() * sizeof(Hider);
  }

 private:
  std::vector<uint32_t> begin_;  // by face; empty if there are no hiders
  std::vector<Hider> hiders_;
};

}  // namespace deltalux::scene
