// SPDX-License-Identifier: Apache-2.0
// Where surfaces meet: lines on triangles along which others cross them or end on them.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/vec.h"

namespace deltalux::samples {

/// Corners, and their numbers: triangles with two in common are neighbours.
struct Face {
  std::array<Vec3d, 3> corners;
  std::array<uint32_t, 3> points;
};

/// A triangle that is looked at, and the face that it is a piece of.
struct Piece {
  std::array<Vec3d, 3> corners;
  uint32_t face;
};

/// On piece `piece`, in its plane.
struct ContactLine {
  uint32_t piece;
  Vec3d start, along;  ///< `along` is unit
  double length;
};

/// By piece, then by the face that crosses it. A face's own neighbours do not cross its pieces.
/// `gap`: what ends so close to a piece's plane touches it; `tolerance`: shorter lines are none,
/// and lines may lie so far outside of the piece. Faces almost in a piece's plane do not count.
std::vector<ContactLine> find_contact_lines(std::span<const Piece> pieces,
                                            std::span<const Face> faces, double gap,
                                            double tolerance, const Workers& workers);

}  // namespace deltalux::samples
