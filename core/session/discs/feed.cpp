// SPDX-License-Identifier: Apache-2.0
// Collects segments in any order, sorts them by slab, and passes them on in portions.
#include "session/discs/feed.h"

#include <algorithm>

#include "base/assertion.h"

namespace deltalux::session {

using segments::HitSlots;
using segments::SegmentSpan;

namespace {

// methods that are efficient with spans of this length get their segments at once
constexpr size_t kAtOnce = 256;

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
  DELTALUX_ASSERT(collected_.count() == 0 || sign_ == sign);
  sign_ = sign;
  collected_.append(span);
}

void Feed::settle() {
  if (collected_.count() >= kPortion) finish();
}

void Feed::finish() {
  const std::vector<uint16_t>& slab = collected_.slab;
  if (slab.empty()) return;
  // Sort by slab: with several threads, all sums of a slab belong to one thread.
  const size_t slabs = size_t(*std::max_element(slab.begin(), slab.end())) + 1;
  std::vector<std::vector<uint32_t>> orders(workers_.threads() > 1 ? slabs : 1);
  for (uint32_t i = 0; i < slab.size(); ++i) orders[slab[i] % orders.size()].push_back(i);
  workers_.for_blocks(orders.size(), 1, [&](size_t k, size_t) { pass_on(orders[k]); });
  collected_.clear();
}

void Feed::pass_on(const std::vector<uint32_t>& order) const {
  segments::SegmentColumns portion;
  for (size_t begin = 0; begin < order.size(); begin += kPortion) {
    const size_t count = std::min(order.size() - begin, kPortion);
    portion.assign(collected_, std::span(order).subspan(begin, count));
    estimator_.accumulate(portion.span(), sign_, sums_);
  }
}

}  // namespace deltalux::session
