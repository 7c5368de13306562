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
  /// A plane's triangles of one material.
  struct Flat {
    std::vector<uint32_t> triangles;
    Vec3d normal{};
    double longest = 0, area = 0;  ///< longest edge; area in all
  };
  /// A square's shape, and what cuts it.
  struct Square {
    uint32_t patch = 0, material = 0;
    double low[2], high[2];
    std::vector<Polygon> pieces;
  };
  struct Cut {
    double a, b, c, weight;
  };
  struct Fan {
    Point a, b, c;
    double area;
  };

  /// A rectangle around a plane's triangles.
  struct Frame {
    Vec3d base, u, v;
    double low[2], high[2];
  };

  std::vector<Flat> find_flats();
  bool lies_in(const Flat& flat, uint32_t triangle) const;
  Frame frame_along(const Flat& flat, Vec3d along) const;
  Frame tightest_frame(const Flat& flat) const;
  void make_patch(BodyCells& out, const Flat& flat);
  void add_squares(const BodyCells::Patch& patch, uint32_t triangle,
                   std::map<uint64_t, uint32_t>& found);
  void merge_small(BodyCells& out, std::vector<uint32_t> triangles);
  void find_cuts(const BodyCells& out);
  void try_cut(const BodyCells& out, uint32_t triangle, uint32_t square);
  /// Cuts along one line are one.
  void add_cut(std::vector<Cut>& cuts, const Cut& cut) const;
  void make_cells(BodyCells& out);
  void make_side(BodyCells& out, BodyCells::Square& own, bool back, const Square& square,
                 const std::vector<Cut>& cuts);
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
  std::vector<std::array<std::vector<Cut>, 2>> cuts_;  // per square and side
  std::vector<Polygon> parts_;                         // of one cell, as long as it is made
  std::vector<Fan> fans_;                              // likewise
};

}  // namespace deltalux::gather
