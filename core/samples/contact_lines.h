// SPDX-License-Identifier: Apache-2.0
// Finds lines of contact: lines on triangles along which other surfaces cross them or end on them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

/// Triangles that may cross others: indices of their corners, and corner indices after merging
/// corners at the same place. Triangles with two merged corners in common are neighbours.
struct Faces {
  std::span<const Triangle> corners, places;
};

/// Triangles to be examined; each is a piece of a face, whose index is `face`.
struct FacePieces {
  std::span<const Triangle> corners;
  std::span<const int64_t> face;
};

/// A line on piece `piece`, in its plane.
struct ContactLine {
  uint32_t piece;
  Vec3d start, along;  ///< `along` is unit
  double length;
};

/// Lines are sorted by piece, then by the face that crosses it. A face's own neighbours do not
/// cross its pieces. `gap`: faces that end this close to a piece's plane touch it. `tolerance`:
/// shorter lines are dropped, and lines may extend this far beyond the piece. Faces almost parallel
/// to a piece do not count.
std::vector<ContactLine> find_contact_lines(std::span<const Vec3d> points, const FacePieces& pieces,
                                            const Faces& faces, double gap, double tolerance,
                                            const Workers& workers);

}  // namespace deltalux::samples
