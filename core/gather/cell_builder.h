// SPDX-License-Identifier: Apache-2.0
// Divides a body's surface into cells; see body_cells.h.
#pragma once
#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "gather/body_cells.h"
#include "gather/polygon.h"

namespace deltalux::gather {

class CellBuilder {
 public:
  CellBuilder(std::span<const BodyCells::Triangle> triangles, float edge)
      : triangles_(triangles), edge_(edge) {}
  void build(BodyCells& out);

 private:
  /// The triangles of one plane and material.
  struct Flat {
    std::vector<uint32_t> triangles;
    Vec3d normal{};
    double longest = 0, area = 0;  ///< the longest edge; the total area
  };
  /// The shape of a square: the parts of triangles within it.
  struct Square {
    uint32_t patch = 0, material = 0;
    double low[2], high[2];
    std::vector<Polygon> pieces;
  };
  /// A line that cuts a square, with its importance.
  struct Cut {
    double a, b, c, weight;
  };
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

  /// Groups triangles by plane and material.
  std::vector<Flat> find_flats();
  /// Whether the triangle lies in the plane, within the tolerance kRise.
  bool lies_in(const Flat& flat, uint32_t triangle) const;
  /// The rectangle with one side along a direction.
  Frame frame_along(const Flat& flat, Vec3d along) const;
  /// The smallest of the rectangles along the triangles' edges.
  Frame tightest_frame(const Flat& flat) const;
  /// Lays squares over a plane.
  void make_patch(BodyCells& out, const Flat& flat);
  /// Adds the squares that a triangle meets. `found`: index of each square of the patch.
  void add_squares(const BodyCells::Patch& patch, uint32_t triangle,
                   std::map<uint64_t, uint32_t>& found);
  /// Merges small triangles into cells.
  void merge_small(BodyCells& out, std::vector<uint32_t> triangles);
  /// Finds the lines along which objects that stand on squares cut them.
  void find_cuts(const BodyCells& out);
  /// Cuts a square by the plane of a triangle, if that stands on it.
  void try_cut(const BodyCells& out, uint32_t triangle, uint32_t square);
  /// Adds a cut, or merges it with one along the same line.
  void add_cut(std::vector<Cut>& cuts, const Cut& cut) const;
  /// Divides all squares into cells.
  void make_cells(BodyCells& out);
  void make_side(BodyCells& out, BodyCells::Square& own, bool back, const Square& square,
                 const std::vector<Cut>& cuts);
  /// Places the probes of a cell.
  void place_probes(BodyCells::Spot& spot, const std::vector<Polygon>& pieces);
  Vec3d corner(uint32_t triangle, int k) const { return Vec3d(triangles_[triangle].corner[k]); }
  Vec3d across(uint32_t triangle) const {
    return cross(corner(triangle, 1) - corner(triangle, 0),
                 corner(triangle, 2) - corner(triangle, 0));
  }
  double longest_edge(uint32_t triangle) const;
  static uint32_t add_cell(BodyCells& out, double area, uint32_t material);

  std::span<const BodyCells::Triangle> triangles_;
  double edge_;
  std::vector<Square> squares_;
  std::vector<std::array<std::vector<Cut>, 2>> cuts_;  // by square and side
  std::vector<Polygon> parts_;                         // shape of the cell being made
  std::vector<Fan> fans_;                              // triangles of that shape
};

}  // namespace deltalux::gather
