// SPDX-License-Identifier: Apache-2.0
// Divides a body's surface into cells; see body_cells.h.
#pragma once
#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/polygon.h"
#include "gather/cells/body_cells.h"

namespace deltalux::gather {

class CellBuilder {
 public:
  CellBuilder(std::span<const BodyCells::Triangle> triangles, float edge,
              const scene::CoincidentFaces& coincident, const Distance& distance,
              const Progress& progress)
      : triangles_(triangles),
        edge_(edge),
        coincident_(coincident),
        distance_(distance),
        progress_(progress) {}
  void build(BodyCells& out);

 private:
  /// The triangles of one plane and material.
  struct Flat {
    std::vector<uint32_t> triangles;
    Vec3d normal{};
    double longest = 0, area = 0;  ///< the longest edge; the total area
  };
  /// A part of a triangle.
  struct Piece {
    Polygon shape;
    uint32_t triangle;
  };
  /// The shape of a square: the parts of triangles within it.
  struct Square {
    uint32_t patch = 0, material = 0;
    double low[2], high[2];
    std::vector<Piece> pieces;
  };
  /// A plane that cuts a clump, with its importance.
  struct PlaneCut {
    Vec3d normal;
    double offset, weight;
  };
  /// Small triangles in one cube of space that face about the same way.
  struct Clump {
    std::vector<uint32_t> triangles;
    uint32_t material = 0;
    Vec3d across;  ///< sum of the triangles' normals, by area
    Box box;
    std::array<std::vector<PlaneCut>, 2> cuts;  ///< by side
  };
  /// What stands on a side of a square or of a clump, seen along the line of contact and upwards.
  struct Standing {
    double low, high, from, to;
    void grow(const Standing& other) {
      low = std::min(low, other.low), high = std::max(high, other.high);
      from = std::min(from, other.from), to = std::max(to, other.to);
    }
    double area() const { return (to - from) * (high - low); }
  };
  /// A line that cuts a square, with its importance.
  struct Cut {
    double a, b, c, weight;
  };
  using Frame2 = std::array<Vec3d, 3>;  ///< origin, two unit vectors of a plane
  /// A triangle of a cell's shape.
  struct Fan {
    Point a, b, c;
    double area;
  };

  /// A rectangle around the triangles of a plane.
  struct Frame {
    Vec3d base, u, v;
    double low[2], high[2];
  };

  static constexpr uint32_t kSteps = 1024;
  /// Checks for cancellation now and then. To be called for each piece of work of some
  /// microseconds.
  void step() {
    if (++steps_ % kSteps == 0) progress_.check();
  }
  /// Groups triangles by plane and material.
  std::vector<Flat> find_flats();
  /// Whether the triangle lies in the plane, within the tolerance kRise.
  bool lies_in(const Flat& flat, uint32_t triangle) const;
  /// The rectangle with one side along a direction.
  Frame frame_along(const Flat& flat, Vec3d along) const;
  /// The smallest of the rectangles along the triangles' edges.
  Frame tightest_frame(const Flat& flat) const;
  /// Lays squares with about the given edge length over a plane.
  void make_patch(BodyCells& out, const Flat& flat, double edge);
  /// Adds the squares that a triangle meets. `found`: index of each square of the patch.
  void add_squares(const BodyCells::Patch& patch, uint32_t triangle,
                   std::map<uint64_t, uint32_t>& found);
  /// Merges small triangles into clumps.
  void merge_small(BodyCells& out, const std::vector<uint32_t>& triangles);
  /// Points whose bounding box is that of a square or, with a number behind those, of a clump.
  std::array<Vec3d, 4> corners_of(const BodyCells& out, uint32_t number) const;
  /// Finds the lines along which objects that stand on squares cut them.
  void find_cuts(const BodyCells& out);
  /// Cuts a square by the plane of a triangle, if that stands on it. What is too small to cut by
  /// itself may be part of a larger plane, see cut_by_planes().
  void try_cut(const BodyCells& out, uint32_t triangle, uint32_t square);
  /// Notes that a triangle of a large plane stands on a clump.
  void try_clump(const BodyCells& out, uint32_t triangle, uint32_t clump);
  /// The extent of a polygon along the line a x + b y = c, and of its height.
  static Standing standing_of(const Polygon& above, double up, double a, double b);
  /// `chord`: length of the line of contact across the whole square or clump.
  bool cuts_by_itself(const Standing& standing, double relief, double chord) const;
  /// Cuts squares and clumps by planes of several triangles.
  void cut_by_planes();
  /// Adds a cut, or merges it with one along the same line.
  void add_cut(std::vector<Cut>& cuts, const Cut& cut) const;
  void add_cut(std::vector<PlaneCut>& cuts, const PlaneCut& cut) const;
  /// Divides all clumps and squares into cells.
  void make_cells(BodyCells& out);
  void make_side(BodyCells& out, BodyCells::Square& own, bool back, const Square& square,
                 const std::vector<Cut>& cuts);
  void make_clump_side(BodyCells& out, BodyCells::Square& own, bool back, const Clump& clump);
  uint32_t add_clump_cell(BodyCells& out, const Clump& clump, bool back);
  /// Adds the areas of a triangle's parts to `areas`; one for each side of each cut.
  void add_parts(uint32_t triangle, bool back, std::span<const PlaneCut> cuts,
                 std::vector<double>& areas) const;
  /// The parts of a piece of a triangle that are seen from one side, in a plane's coordinates.
  void find_seen(const Frame2& frame, const Piece& piece, bool back,
                 std::vector<Polygon>& out) const;
  /// Places the probes of a cell.
  void place_probes(BodyCells::Spot& spot, const std::vector<Polygon>& pieces);
  Vec3d corner(uint32_t triangle, int k) const { return Vec3d(triangles_[triangle].corner[k]); }
  Vec3d across(uint32_t triangle) const {
    return cross(corner(triangle, 1) - corner(triangle, 0),
                 corner(triangle, 2) - corner(triangle, 0));
  }
  double longest_edge(uint32_t triangle) const;
  Polygon projected(const Frame2& frame, uint32_t triangle) const;
  static uint32_t add_cell(BodyCells& out, double area, uint32_t material);

  std::span<const BodyCells::Triangle> triangles_;
  double edge_;
  const scene::CoincidentFaces& coincident_;
  const Distance& distance_;
  const Progress& progress_;
  uint32_t steps_ = 0;
  std::vector<Square> squares_;
  std::vector<Clump> clumps_;
  std::vector<std::array<std::vector<Cut>, 2>> cuts_;  // by square and side
  // Planes that stand on a square or on a clump with parts too small to cut by themselves: by
  // number (clumps after squares), side and patch.
  struct Stand {
    Standing standing;
    Cut cut;         ///< of a square
    PlaneCut plane;  ///< of a clump
    double relief;
    double chord;  ///< see cuts_by_itself()
  };
  std::map<std::array<uint32_t, 3>, Stand> stands_;
  std::vector<Polygon> parts_, seen_;  // shape of the cell being made; of a piece
  std::vector<Fan> fans_;              // triangles of that shape
};

}  // namespace deltalux::gather
