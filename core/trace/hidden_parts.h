// SPDX-License-Identifier: Apache-2.0
// Where faces are hidden by others in their own plane: rays do not stop there, but at the others.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/coincident_faces.h"

namespace deltalux::trace {

class HiddenParts {
 public:
  HiddenParts(std::span<const scene::Face> faces, const scene::CoincidentFaces& coincident);

  /// How many faces are hidden in part, and the i-th of them.
  size_t size() const { return tables_.size(); }
  uint32_t face(uint32_t i) const { return tables_[i].face; }
  /// Whether the point with barycentrics u and v on the i-th of these faces is hidden, as seen from
  /// its front or back. False near the border of what hides it: there, rays may miss that.
  bool hides(uint32_t i, float u, float v, bool from_back) const;

 private:
  /// A triangle: there, all a u + b v + c >= 0.
  struct Part {
    std::array<float, 3> a, b, c;
    std::array<bool, 2> from;  ///< from the front, from the back
  };
  /// The parts of one face, by squares of its barycentrics.
  struct Table {
    uint32_t face;
    uint32_t first;  ///< index in begin_
    uint32_t side;   ///< squares in each direction
  };
  static Part part_of(const scene::Face& hidden, const scene::Face& hider);
  void add_table(uint32_t face, std::span<const Part> parts);

  std::vector<Table> tables_;
  std::vector<uint32_t> begin_;  // by square, and one more for each table: index in parts_
  std::vector<Part> parts_;
};

}  // namespace deltalux::trace
