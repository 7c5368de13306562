// SPDX-License-Identifier: Apache-2.0
// Cells where light falls now, and places on them.
#pragma once
#include <span>
#include <vector>

#include "gather/chain.h"
#include "gather/evaluate.h"

namespace deltalux::gather {

/// All of them that lie bare somewhere, in a fixed order.
class LitCells {
 public:
  /// Refers to its arguments. `covered`: of Coverage.
  LitCells(const Present& present, const Evaluation& evaluation, std::span<const uint16_t> covered);

  size_t size() const { return cells_.size(); }
  /// Number of the i-th among all cells.
  uint32_t number(size_t i) const { return cells_[i].number; }
  static constexpr uint32_t kPlaces = BodyCells::kProbes;
  /// On the first bare place of the i-th, from place `from` of kPlaces on; of a cell of small
  /// triangles, on one of these. Its normal is zero where no triangle has one.
  direct::Receiver place(size_t i, uint32_t from) const;

 private:
  struct Cell {
    uint32_t number, own;  ///< among all, of its body
    uint32_t body;
    uint16_t covered;  ///< by place
  };
  /// A body with its small triangles in the order of their cells.
  struct Body {
    const BodyCells* cells;
    uint32_t object;  ///< or kNone: it does not move
    uint32_t first_primitive;
    Pose pose;
    std::vector<uint32_t> triangles, begin;  ///< `begin`: in `triangles`, per cell and one more
    std::vector<double> area;                ///< of a triangle and those before it in its cell
  };
  /// In the world.
  struct Triangle {
    Vec3d corner, edge_u, edge_v;
    Vec3d across() const { return cross(edge_u, edge_v); }
  };
  Triangle triangle(const Body& body, uint32_t number) const;
  void sort_small(Body& body) const;
  direct::Receiver on_small(const Body& body, uint32_t own, uint32_t from) const;

  const scene::Scene& scene_;
  std::vector<Body> bodies_;
  std::vector<Cell> cells_;
};

/// On some of the lit cells, in the middle of things, wherever samples are.
std::vector<direct::Receiver> lit_places(const LitCells& lit);

}  // namespace deltalux::gather
