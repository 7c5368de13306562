// SPDX-License-Identifier: Apache-2.0
// The surface of one rigid body divided into cells: where light lands, it is counted by cell. In
// the body's own space, so that a movable takes its cells along.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace deltalux::gather {

inline constexpr uint32_t kNoCell = 0xffffffffu;

/// Triangles of one plane and material share a grid of squares, whichever triangle they lie on;
/// where something stands on a square, its plane cuts it, so that no light leaks under a wall.
/// Triangles too small for that are put together by place and direction. Each side has cells of
/// its own. All is a pure function of the triangles and the edge's length.
class BodyCells {
 public:
  struct Triangle {
    Vec3f corner[3];
    uint32_t material;
  };

  BodyCells() = default;
  /// `edge`: of a square, metres.
  BodyCells(std::span<const Triangle> triangles, float edge);

  size_t size() const { return area_.size(); }
  /// How far from their cells' plane triangles may lie.
  float rise() const { return rise_; }
  /// The cell at `p` on `triangle`, on the side that a ray along `w` meets; kNoCell on a triangle
  /// without area. `nudge`: looked up so far back, along the surface, towards where the ray came
  /// from, but no farther than half its flight of length `t`: at the foot of a wall its side is
  /// then beyond doubt.
  uint32_t find(uint32_t triangle, Vec3f p, Vec3f w, float t = 0, float nudge = 0) const;
  std::span<const float> areas() const { return area_; }
  std::span<const uint32_t> materials() const { return material_; }
  /// Points spread evenly over a cell; cells of small triangles have none.
  static constexpr uint32_t kProbes = 16;
  bool has_probes(uint32_t cell) const { return spot_[cell].patch != kNoCell; }
  Vec3f probe(uint32_t cell, uint32_t number) const;
  /// Triangles of each cell of small ones, in the order of the cells, both of a pair; begin[cell]
  /// and begin[cell + 1] are the ends of each. Other cells have none.
  void sort_small(std::vector<uint32_t>& triangles, std::vector<uint32_t>& begin) const;
  /// Of a cell of small triangles: whether it is their back.
  bool is_back(uint32_t cell) const { return spot_[cell].back; }
  /// Unit normal on the cell's side; not of small triangles.
  Vec3f normal(uint32_t cell) const;
  /// All of the cell lies in it.
  struct Ball {
    Vec3f centre;
    float radius;
  };
  Ball ball(uint32_t cell) const;
  size_t bytes() const;

 private:
  friend class CellBuilder;
  static constexpr float kRise = 0x1p-10f;  // of the edge
  /// Parts a square in two: a * x + b * y > c, in the patch's frame.
  struct Line {
    float a, b, c;
  };
  struct Face {
    Vec3f normal;
    uint32_t patch;  ///< or kNoCell: then all of it is in `cell`, its back in the one after
    uint32_t cell;
  };
  struct Patch {
    Vec3f origin, u, v;
    float columns_per_metre, rows_per_metre;
    uint32_t columns, rows;
    size_t first;    ///< in table_, or in keys_
    uint32_t count;  ///< of keys_; 0: in table_
  };
  struct Side {
    uint32_t first_line = 0, lines = 0;
    uint32_t first_part = 0;  ///< in parts_, 2^lines cells; those without area are kNoCell
    uint32_t largest = kNoCell;
  };
  struct Square {
    Side side[2];
  };

  struct Spot {
    uint32_t patch = kNoCell;
    float low[2]{}, high[2]{};  ///< of its square, in the patch's frame
    bool back = false;
    std::array<uint8_t, 2 * kProbes> probe{};  ///< in 256ths of the square
    Box box{};                                 ///< of small triangles
  };

  uint32_t square_at(const Patch& patch, uint32_t column, uint32_t row) const;

  float rise_ = 0;
  std::vector<Face> faces_;
  std::vector<Patch> patches_;
  std::vector<uint32_t> table_;                      // per square of a patch's rectangle
  std::vector<std::pair<uint64_t, uint32_t>> keys_;  // the same of patches that fill little of it
  std::vector<Square> squares_;
  std::vector<Line> lines_;
  std::vector<uint32_t> parts_;
  std::vector<float> area_;         // per cell
  std::vector<uint32_t> material_;  // per cell
  std::vector<Spot> spot_;          // per cell
};

}  // namespace deltalux::gather
