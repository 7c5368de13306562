// SPDX-License-Identifier: Apache-2.0
// The layer of cells: the surface in pieces, and the light that paths bring to each.
#pragma once
#include <span>

#include "base/progress.h"
#include "gather/cells/cells.h"
#include "gather/cells/coverage.h"
#include "gather/hits/cell_light.h"
#include "session/world/lanes.h"
#include "session/world/world.h"
#include "trace/change.h"

namespace deltalux::session {

/// Without a final gather there are no cells, and nothing here does anything.
struct CellLayer {
  explicit CellLayer(const World& w) : world(w) {}

  const World& world;
  gather::Cells division;
  gather::CellSums sums;
  gather::CellLight light;  ///< as of the last read
  gather::Coverage coverage;

  /// Divides the surface into cells, which hold no light yet. Throws SceneError, Cancelled.
  void divide(Progress& progress);
  /// Adds cells for objects, and sums for light groups, that edits added. Throws Cancelled.
  void grow(const Progress& progress);
  /// Removes those of objects and light groups that a failed edit had added.
  void shrink() noexcept;
  /// Gives each present cell its sums, see World::cell_groups(); new ones are 0 and count as
  /// touched.
  void lay_out_sums();
  /// Finds what objects in contact cover of cells; update(): where this edit changed it.
  void cover(Progress& progress);
  void update(const trace::Change& change);
  /// Marks all sums as changed.
  void touch_all();
  /// Brings `light` up to date.
  void renew_light();
  /// `units`: World::cell_units(), to which the result refers.
  gather::CellState state(std::span<const double> units) {
    return {world.scene, division, coverage, sums, units};
  }
  /// The power of one more path over the surface of a room of usual size, per channel: of the light
  /// whose paths carry most. Where a few weak paths came through an opening, one that keeps its
  /// power may be missing. Guided paths are as many as they need be.
  Vec3d power_of_one_path() const;
  /// Whether any path has reached the cell.
  bool is_lit(uint32_t cell) const;
  /// Whether no sum is negative, since only what was added is removed.
  bool are_sums_possible() const;
  size_t bytes() const {
    return division.bytes() + coverage.bytes() + sums.bytes() + light.bytes();
  }
  void digest(Lanes& lanes) const;
};

}  // namespace deltalux::session
