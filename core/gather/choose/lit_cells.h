// SPDX-License-Identifier: Apache-2.0
// Lists the cells that send light at present, and chooses places on them.
#pragma once
#include <span>
#include <vector>

#include "gather/hits/chain.h"
#include "gather/hits/evaluate.h"

namespace deltalux::gather {

/// All lit cells that are not covered completely, in a fixed order.
class LitCells {
 public:
  /// Keeps references to its arguments. `covered`: see Coverage.
  LitCells(const Context& context, const Evaluation& evaluation, std::span<const uint16_t> covered);

  size_t size() const { return cells_.size(); }
  /// Cell index of the i-th lit cell.
  uint32_t number(size_t i) const { return cells_[i].number; }
  static constexpr uint32_t kPlaces = BodyCells::kProbes;
  /// A receiver on the i-th lit cell: at its first uncovered probe from number `from` on; for a
  /// cell of small triangles, a point on one of these. Its normal is zero if the triangle has none.
  direct::Receiver place(size_t i, uint32_t from) const;

 private:
  struct Cell {
    /// Index among all cells; index within its body.
    uint32_t number, own;
    uint32_t body;
    uint16_t covered;  ///< one bit per probe
  };
  /// A body, with its small triangles sorted by cell.
  struct Body {
    const BodyCells* cells;
    uint32_t object;  ///< kNone: the static geometry
    uint32_t first_primitive;
    Pose pose;
    /// `begin`: index in `triangles` of each cell's first one, and one more
    std::vector<uint32_t> triangles, begin;
    std::vector<double> area;  ///< cumulative within each cell
  };
  /// In world space.
  struct Triangle {
    Vec3d corner, edge_u, edge_v;
    Vec3d across() const { return cross(edge_u, edge_v); }
  };
  /// The triangle's corner and edges; `number` is its index within the body.
  Triangle triangle(const Body& body, uint32_t number) const;
  /// Fills the lists of small triangles.
  void sort_small(Body& body) const;
  /// A receiver on a small triangle of the cell.
  direct::Receiver on_small(const Body& body, uint32_t own, uint32_t from) const;

  const scene::Scene& scene_;
  std::vector<Body> bodies_;
  std::vector<Cell> cells_;
};

/// Receivers on some of the lit cells, spread over them independently of the samples.
std::vector<direct::Receiver> lit_places(const LitCells& lit);

}  // namespace deltalux::gather
