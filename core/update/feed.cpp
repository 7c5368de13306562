// SPDX-License-Identifier: Apache-2.0
// Collects segments in any order, sorts them by slab, and passes them on in portions.
#include "update/feed.h"

#include <algorithm>

namespace deltalux::update {

using segments::HitSlots;
using segments::SegmentSpan;

namespace {

// methods that are efficient with spans of this length get their segments at once
constexpr size_t kAtOnce = 256;

const float* SegmentSpan::* const kColumns[8] = {
    &SegmentSpan::ox, &SegmentSpan::oy, &SegmentSpan::oz,     &SegmentSpan::dx,
    &SegmentSpan::dy, &SegmentSpan::dz, &SegmentSpan::length, &SegmentSpan::extended};

}  // namespace

Feed::Feed(const estimate::SignedEstimator& estimator, const estimate::EnergySums& sums,
           const Workers& workers)
    : estimator_(estimator),
      sums_(sums),
      workers_(workers),
      collects_(estimator.best_span() > kAtOnce) {}

void Feed::add(const SegmentSpan& span, int sign, HitSlots* slots) {
  if (!collects_) {
    estimator_.accumulate(span, sign, sums_, slots);
    return;
  }
  if (slots) std::fill_n(slots, span.count, HitSlots{{HitSlots::kMany, HitSlots::kFree}});
  const std::lock_guard lock(mutex_);
  sign_ = sign;
  for (int k = 0; k < 8; ++k) {
    const float* from = span.*kColumns[k];
    column_[k].insert(column_[k].end(), from, from + span.count);
  }
  power_.insert(power_.end(), span.power, span.power + 3 * span.count);
  slab_.insert(slab_.end(), span.slab, span.slab + span.count);
}

void Feed::settle() {
  if (slab_.size() >= kPortion) finish();
}

void Feed::finish() {
  if (slab_.empty()) return;
  // Sort by slab: with several threads, all sums of a slab belong to one thread.
  const size_t slabs = size_t(*std::max_element(slab_.begin(), slab_.end())) + 1;
  std::vector<std::vector<uint32_t>> orders(workers_.threads() > 1 ? slabs : 1);
  for (uint32_t i = 0; i < slab_.size(); ++i) orders[slab_[i] % orders.size()].push_back(i);
  workers_.for_blocks(orders.size(), 1, [&](size_t k, size_t) { pass_on(orders[k]); });
  for (std::vector<float>& column : column_) column.clear();
  power_.clear();
  slab_.clear();
}

void Feed::pass_on(const std::vector<uint32_t>& order) const {
  std::vector<float> column[8];
  std::vector<uint32_t> power;
  std::vector<uint16_t> slab;
  for (size_t begin = 0; begin < order.size(); begin += kPortion) {
    const size_t end = std::min(order.size(), begin + kPortion);
    for (int k = 0; k < 8; ++k) {
      column[k].clear();
      for (size_t i = begin; i < end; ++i) column[k].push_back(column_[k][order[i]]);
    }
    power.clear();
    slab.clear();
    for (size_t i = begin; i < end; ++i) {
      const uint32_t* p = power_.data() + 3 * size_t(order[i]);
      power.insert(power.end(), p, p + 3);
      slab.push_back(slab_[order[i]]);
    }
    SegmentSpan span{.count = end - begin, .power = power.data(), .slab = slab.data()};
    for (int k = 0; k < 8; ++k) span.*kColumns[k] = column[k].data();
    estimator_.accumulate(span, sign_, sums_);
  }
}

}  // namespace deltalux::update
