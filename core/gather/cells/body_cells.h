// SPDX-License-Identifier: Apache-2.0
// Divides the surface of one rigid body into cells, which sum the light that lands on them. Cells
// are defined in the body's local space, so that a movable takes its cells along.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/progress.h"
#include "base/vec.h"
#include "gather/cells/square_edges.h"
#include "scene/coincident_faces.h"

namespace deltalux::gather {

inline constexpr uint32_t kNoCell = 0xffffffffu;

/// Triangles of one plane and material share a grid of squares, whichever triangle a square lies
/// on. Where something stands on a square, its plane cuts the square, so that no light leaks under
/// a wall. Triangles too small for squares are merged into clumps by position and direction, and
/// cut like squares. Each side has cells of its own. Where triangles lie in one place, the area
/// counts once: in the cell of the one that is seen. A pure function of the triangles, of which
/// hide others, and of the squares' edge length.
class BodyCells {
 public:
  struct Triangle {
    Vec3f corner[3];
    uint32_t material;
  };

  BodyCells() = default;
  /// `edge`: edge length of a square, in metres; larger if there would be too many squares, see
  /// square_edges(). Throws Cancelled.
  BodyCells(std::span<const Triangle> triangles, float edge,
            const scene::CoincidentFaces& coincident = {}, const Distance& distance = {},
            const Progress& progress = {});

  size_t size() const { return area_.size(); }
  /// The largest distance of a triangle from the plane of its cell.
  float rise() const { return rise_; }
  /// The cell at point `p` of `triangle`, on the side that a ray along `w` hits; kNoCell for a
  /// triangle without area. The point is first moved back by `nudge` along the surface, towards the
  /// origin of the ray, but by no more than half of the ray's length `t`: at the foot of a wall, it
  /// is then clearly on one side.
  uint32_t find(uint32_t triangle, Vec3f p, Vec3f w, float t = 0, float nudge = 0) const;
  /// Fetches what find() reads first into the cache.
  void prefetch(uint32_t triangle) const { __builtin_prefetch(&faces_[triangle]); }
  std::span<const float> areas() const { return area_; }
  std::span<const uint32_t> materials() const { return material_; }
  /// Points spread evenly over a cell. Cells of small triangles have none.
  static constexpr uint32_t kProbes = 16;
  bool has_probes(uint32_t cell) const { return spot_[cell].patch != kNoCell; }
  Vec3f probe(uint32_t cell, uint32_t number) const;
  /// Lists the triangles of each cell of small triangles, cell by cell (each for both sides): those
  /// of `cell` are triangles[begin[cell]] to triangles[begin[cell + 1] - 1]. Other cells have none,
  /// nor do very small parts of clumps.
  void sort_small(std::vector<uint32_t>& triangles, std::vector<uint32_t>& begin) const;
  /// Whether a cell of small triangles is their back side.
  bool is_back(uint32_t cell) const { return spot_[cell].back; }
  /// Unit normal on the cell's side; only for cells with probes.
  Vec3f normal(uint32_t cell) const;
  /// A bounding sphere of the cell.
  struct Ball {
    Vec3f centre;
    float radius;
  };
  Ball ball(uint32_t cell) const;
  size_t bytes() const;

 private:
  friend class CellBuilder;
  static constexpr float kRise = 0x1p-10f;  // in units of the edge
  /// Cuts a square in two: a * x + b * y > c, in the coordinates of the patch.
  struct Line {
    float a, b, c;
  };
  /// A plane that cuts a clump in two: dot(normal, p) > offset.
  struct Plane {
    Vec3f normal;
    float offset;
  };
  /// A triangle: its plane's patch, or its clump if it is small; the other one is kNoCell.
  struct Face {
    Vec3f normal;
    uint32_t patch;
    uint32_t clump;
  };
  /// The grid of squares of one plane and material.
  struct Patch {
    Vec3f origin, u, v;
    float columns_per_metre, rows_per_metre;
    uint32_t columns, rows;
    size_t first;    ///< index of its first entry in table_, or in keys_
    uint32_t count;  ///< number of its entries in keys_; 0 if it uses table_
  };
  /// One side of a square or of a clump, divided into parts by lines or by planes.
  struct Side {
    uint32_t first_line = 0, lines = 0;
    /// Index in parts_ of its 2^lines parts; parts without area are kNoCell.
    uint32_t first_part = 0;
    uint32_t largest = kNoCell;
  };
  struct Square {
    Side side[2];
  };

  /// What belongs to a cell beside area and material.
  struct Spot {
    uint32_t patch = kNoCell;
    float low[2]{}, high[2]{};  ///< bounds of its square, in the coordinates of the patch
    bool back = false;
    std::array<uint8_t, 2 * kProbes> probe{};  ///< positions in units of 1/256 of the square
    Box box{};                                 ///< bounds of small triangles
  };

  uint32_t square_at(const Patch& patch, uint32_t column, uint32_t row) const;
  uint32_t find_in_clump(const Face& face, Vec3f p, Vec3f w, float t, float nudge) const;
  uint32_t cell_of(const Side& side, uint32_t part) const {
    const uint32_t cell = parts_[side.first_part + part];
    return cell != kNoCell ? cell : side.largest;
  }

  /// Index of a square, or kNoCell.
  float rise_ = 0;
  std::vector<Face> faces_;
  std::vector<Patch> patches_;
  std::vector<uint32_t> table_;  // index of each square in the patch's rectangle
  // sparse variant of table_, for patches that fill little of their rectangle
  std::vector<std::pair<uint64_t, uint32_t>> keys_;
  std::vector<Square> squares_, clumps_;
  std::vector<Line> lines_;
  std::vector<Plane> planes_;
  std::vector<std::pair<uint32_t, uint32_t>> cut_triangles_;  // cell, triangle: of cut clumps
  std::vector<uint32_t> parts_;
  std::vector<float> area_;         // per cell
  std::vector<uint32_t> material_;  // per cell
  std::vector<Spot> spot_;          // per cell
};

}  // namespace deltalux::gather
