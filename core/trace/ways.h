// SPDX-License-Identifier: Apache-2.0
// Straight ways from one place to many, which are tested together against what moved.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"

namespace deltalux::trace {

/// The ends of the ways, each a ball, as a structure of arrays.
class Ways {
 public:
  void clear() { x_.clear(), y_.clear(), z_.clear(), radius_.clear(), marks_.clear(); }
  void add(Vec3f end, float radius = 0) {
    x_.push_back(end.x), y_.push_back(end.y), z_.push_back(end.z), radius_.push_back(radius);
  }
  size_t size() const { return x_.size(); }
  Vec3f end(size_t i) const { return {x_[i], y_[i], z_[i]}; }

  /// Clears all marks; before the first mark_*().
  void unmark() { marks_.assign(size(), 0); }
  /// Marks ways from a place that meet one of the boxes, before they end anywhere in their balls.
  /// It marks a few more.
  void mark_meeting(std::span<const Box> boxes, Vec3f from);
  /// Marks ways whose ends are in a shadow volume, with the same result as its contains().
  template <class Volume>
  void mark_within(const Volume& volume) {
    volume.mark(x_.data(), y_.data(), z_.data(), size(), marks_.data());
  }
  bool marked(size_t i) const { return marks_[i]; }

 private:
  std::vector<float> x_, y_, z_, radius_;
  std::vector<uint32_t> marks_;
};

}  // namespace deltalux::trace
