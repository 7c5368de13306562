// SPDX-License-Identifier: Apache-2.0
// Where surfaces meet: lines on triangles along which others cross them or end on them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

/// Triangles that may cross others: their corners, and numbers of these by place. Those with two in
/// common are neighbours.
struct Faces {
  std::span<const Triangle> corners, places;
};

/// Triangles that are looked at, and the face that each is a piece of.
struct FacePieces {
  std::span<const Triangle> corners;
  std::span<const int64_t> face;
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
std::vector<ContactLine> find_contact_lines(std::span<const Vec3d> points, const FacePieces& pieces,
                                            const Faces& faces, double gap, double tolerance,
                                            const Workers& workers);

}  // namespace deltalux::samples
