// SPDX-License-Identifier: Apache-2.0
// Squares as a structure of arrays, for SIMD.
#include "gather/aim/targets.h"

#include <algorithm>

namespace deltalux::gather {

Targets::Targets(std::span<const Guide> guides, const Beams& beams) {
  constexpr size_t kLanes = 16;
  static_assert(kMaxGuides % kLanes == 0);
  padded_ = (guides.size() + kLanes - 1) / kLanes * kLanes;
  squares_.reserve(guides.size());
  all_.reserve(guides.size() + beams.size());
  for (size_t g = 0; g < guides.size(); ++g) {
    all_.push_back(&squares_.emplace_back(guides[g]));
    columns_.set(g, guides[g]);
    brought_[g] = guides[g].radiosity / guides[g].around;
  }
  for (size_t b = 0; b < beams.size(); ++b) all_.push_back(&beams[b]);
}

void Targets::shares(Vec3f from, Vec3f n, Values& out) const {
  const GuideSquares<kMaxGuides>& at = columns_;
  for (size_t g = 0; g < padded_; ++g)
    out[g] = brought_[g] * share_of_view({at.x[g], at.y[g], at.z[g]},
                                         {at.normal_x[g], at.normal_y[g], at.normal_z[g]},
                                         at.half[g], from, n);
  for (size_t i = squares_.size(); i < all_.size(); ++i) out[i] = all_[i]->share(from, n);
}

void Targets::may_be_dense(Vec3f from, Vec3f w, Values& out) const {
  columns_.may_meet(from, w, padded_, out);
  for (size_t i = squares_.size(); i < all_.size(); ++i) out[i] = 1;
}

}  // namespace deltalux::gather
