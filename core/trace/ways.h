// SPDX-License-Identifier: Apache-2.0
// Straight ways from one place to many, which are tested together against what moved.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "base/assertion.h"
#include "base/vec.h"
#include "trace/shadow_volume.h"

namespace deltalux::trace {

/// The ends of the ways, each a ball, as a structure of arrays.
class Ways {
 public:
  /// Makes room for so many ways, and has none.
  void clear(size_t most) {
    size_ = 0;
    if (x_.size() >= most) return;
    for (std::vector<float>* own : {&x_, &y_, &z_, &radius_}) own->resize(most);
    marks_.resize(most);
  }
  void add(Vec3f end, float radius = 0) {
    DELTALUX_ASSERT(size_ < x_.size());
    x_[size_] = end.x, y_[size_] = end.y, z_[size_] = end.z, radius_[size_++] = radius;
  }
  size_t size() const { return size_; }

  /// Clears all marks; before the first mark_*().
  void unmark() { std::fill_n(marks_.begin(), size_, 0u); }
  /// Marks ways from a place that meet one of the boxes, before they end anywhere in their balls.
  /// It marks a few more.
  void mark_meeting(std::span<const Box> boxes, Vec3f from);
  /// Marks ways whose ends are in a shadow volume, with the same result as its contains().
  void mark_within(const ShadowVolume& volume) {
    volume.mark(x_.data(), y_.data(), z_.data(), size_, marks_.data());
  }
  bool marked(size_t i) const { return marks_[i]; }
  Vec3f end(size_t i) const { return {x_[i], y_[i], z_[i]}; }

 private:
  size_t size_ = 0;
  std::vector<float> x_, y_, z_, radius_;
  std::vector<uint32_t> marks_;
};

}  // namespace deltalux::trace
