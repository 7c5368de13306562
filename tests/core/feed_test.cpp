// SPDX-License-Identifier: Apache-2.0
// A feed passes every segment on once, with its sign: at once, or later in portions of one slab.
#include "session/discs/feed.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "base/random.h"

namespace deltalux::session {
namespace {

using segments::HitSlots;
using segments::SegmentColumns;

/// Keeps what it is given.
class Recorder final : public estimate::SignedEstimator {
 public:
  explicit Recorder(size_t best_span) : best_span_(best_span) {}

  struct Call {
    std::set<uint16_t> slabs;
    size_t count;
  };
  estimate::Stats accumulate(const segments::SegmentSpan& s, int sign,
                             const estimate::EnergySums& sums, HitSlots* slots) const override {
    const std::lock_guard lock(mutex_);
    EXPECT_EQ(sums.samples, 5u);
    Call& call = calls.emplace_back(Call{{}, s.count});
    for (size_t i = 0; i < s.count; ++i) {
      const uint32_t name = s.power[3 * i];
      call.slabs.insert(s.slab[i]);
      EXPECT_EQ(s.slab[i], slab_of(name));
      EXPECT_EQ(s.ox[i], float(name));
      EXPECT_EQ(s.dz[i], float(name) + 0.5f);
      EXPECT_EQ(s.extended[i], 2 * float(name));
      seen[name] += sign;
      ++passed;
      if (slots) slots[i] = {{name, HitSlots::kFree}};
    }
    return {};
  }
  const samples::DiscSet& discs() const override { return discs_; }
  size_t best_span() const override { return best_span_; }

  static uint16_t slab_of(uint32_t name) { return uint16_t(mix64(name) % 5); }

  mutable std::vector<Call> calls;
  mutable std::map<uint32_t, int> seen;  ///< by name: sum of signs
  mutable size_t passed = 0;

 private:
  size_t best_span_;
  samples::DiscSet discs_;
  mutable std::mutex mutex_;
};

/// Segments with names from `first` on.
SegmentColumns named(uint32_t first, size_t count) {
  SegmentColumns out;
  for (size_t i = 0; i < count; ++i) {
    const uint32_t name = first + uint32_t(i);
    const float f = float(name);
    const uint32_t power[3] = {name, 1, 2};
    out.add({f, 0, 0}, {0, 0, f + 0.5f}, f, 2 * f, power);
    out.slab.push_back(Recorder::slab_of(name));
  }
  return out;
}

class FeedTest : public testing::TestWithParam<int> {
 protected:
  /// Passes segments with names up to `count`, in pieces.
  void add(Feed& feed, size_t count, int sign) const {
    for (uint32_t name = 1; name <= count; name += kPiece)
      feed.add(named(name, std::min<size_t>(kPiece, count + 1 - name)).span(), sign);
  }
  void expect_each(const Recorder& recorder, size_t count, int sign) const {
    EXPECT_EQ(recorder.passed, count);
    EXPECT_EQ(recorder.seen.size(), count);
    for (const auto& [name, sum] : recorder.seen) ASSERT_EQ(sum, sign) << name;
  }

  static constexpr uint32_t kPiece = 200;
  Workers workers_{GetParam()};
  std::vector<int64_t> data_ = std::vector<int64_t>(75);
  estimate::EnergySums sums_{data_.data(), 5};
};

INSTANTIATE_TEST_SUITE_P(Threads, FeedTest, testing::Values(1, 3));

TEST_P(FeedTest, PassesShortSpansOnAtOnce) {
  const Recorder recorder(256);
  Feed feed(recorder, sums_, workers_);
  const SegmentColumns some = named(1, 3);
  std::vector<HitSlots> slots(3);
  feed.add(some.span(), 1, slots.data());
  EXPECT_EQ(recorder.passed, 3u);
  for (uint32_t i = 0; i < 3; ++i) EXPECT_EQ(slots[i].disc[0], i + 1);
  feed.settle();
  feed.finish();
  expect_each(recorder, 3, 1);
}

TEST_P(FeedTest, CollectsForLongSpansUntilItIsFinished) {
  const Recorder recorder(257);
  Feed feed(recorder, sums_, workers_);
  for (const int sign : {1, -1, -1}) {
    std::vector<HitSlots> slots(4, HitSlots{{1, 2}});
    feed.add(named(1, 3).span(), sign, slots.data());
    for (uint32_t i = 0; i < 3; ++i) EXPECT_EQ(slots[i].disc[0], HitSlots::kMany);
    EXPECT_EQ(slots[3].disc[0], 1u);  // of no segment
    const size_t before = recorder.passed;
    feed.settle();
    EXPECT_EQ(recorder.passed, before);
    feed.finish();
    feed.finish();
    EXPECT_EQ(recorder.passed, before + 3);
  }
  EXPECT_EQ(recorder.passed, 9u);
  EXPECT_EQ(recorder.seen, (std::map<uint32_t, int>{{1, -1}, {2, -1}, {3, -1}}));
}

TEST_P(FeedTest, SettlesFullPortionsAlone) {
  const Recorder recorder(257);
  Feed feed(recorder, sums_, workers_);
  add(feed, kPortion - 1, 1);
  feed.settle();
  EXPECT_EQ(recorder.passed, 0u);
  feed.add(named(kPortion, 1).span(), 1);
  feed.settle();
  expect_each(recorder, kPortion, 1);
}

TEST_P(FeedTest, PassesPortionsOfWhichNoTwoThreadsShareASlab) {
  constexpr size_t kCount = 6 * kPortion + 17;
  const Recorder recorder(257);
  Feed feed(recorder, sums_, workers_);
  add(feed, kCount, -1);
  feed.finish();
  expect_each(recorder, kCount, -1);
  for (const Recorder::Call& call : recorder.calls) {
    EXPECT_LE(call.count, kPortion);
    if (workers_.threads() > 1) EXPECT_EQ(call.slabs.size(), 1u);
  }
  // Five slabs of a little more than a portion each, or all in a row.
  EXPECT_EQ(recorder.calls.size(), workers_.threads() > 1 ? 10u : 7u);
}

}  // namespace
}  // namespace deltalux::session
