// SPDX-License-Identifier: Apache-2.0
// Sums of paths: told as changes since the last time, and added where light is evaluated.
#include <algorithm>
#include <bit>
#include <functional>
#include <string>
#include <utility>

#include "base/error.h"
#include "samples/openness.h"
#include "session/exchange/exchange.h"

namespace deltalux::session {
namespace {

/// Throws OptionError unless the places of `row` are those of a row of `size` numbers.
void check_row(const char* name, const SparseRow& row, uint64_t size) {
  if (row.size != size)
    throw OptionError(std::string(name) + ": found changes of " + std::to_string(row.size) +
                      " numbers, expected " + std::to_string(size) + kSame);
  if (row.at.size() != row.value.size() ||
      std::any_of(row.at.begin(), row.at.end(), [&](uint64_t at) { return at >= size; }))
    throw OptionError(std::string(name) +
                      ": found places beyond the end, or another number of values" + kSame);
}

float to_float(int64_t bits) { return std::bit_cast<float>(uint32_t(bits)); }

/// The bits of what this session computed of DiscSets::openness.
SparseRow own_openness(const State& s) {
  SparseRow out{s.samples.size(), {}, {}};
  const auto [from, end] = s.own_samples();
  for (size_t i = from; i < end; ++i) {
    out.at.push_back(i);
    out.value.push_back(std::bit_cast<uint32_t>(s.discs.openness[i]));
  }
  return out;
}

/// Throws OptionError unless `row` has the openness of some of so many samples.
void check_openness(const SparseRow& row, uint64_t samples) {
  check_row("openness", row, samples);
  const auto sound = [](int64_t bits) {
    return bits >= 0 && bits <= UINT32_MAX && to_float(bits) >= 0 &&
           to_float(bits) <= samples::kMaxOpenness;
  };
  if (!std::all_of(row.value.begin(), row.value.end(), sound))
    throw OptionError(std::string("openness: found numbers that are none") + kSame);
}

/// Adds a range to ranges that share no path. Throws OptionError if it shares some with them.
void add_range(const PathRange& range, uint64_t paths, std::vector<PathRange>& ranges) {
  const bool sound = range.first <= range.last && range.last <= paths;
  const auto overlaps = [&](const PathRange& other) {
    return range.first < other.last && other.first < range.last;
  };
  if (!sound || std::any_of(ranges.begin(), ranges.end(), overlaps))
    throw OptionError("add_path_changes: found those of paths " + std::to_string(range.first) +
                      " to " + std::to_string(range.last) + " of " + std::to_string(paths) +
                      ", of which some are added already; add the path_changes of each range once");
  ranges.push_back(range);
}

std::string states(const std::optional<uint64_t>& since, uint64_t edits) {
  return (since ? "from edit " + std::to_string(*since) : "from the bake") + " to edit " +
         std::to_string(edits);
}

/// Appends the places from `first` on, `count` of them, where `now` differs from `before`. Sets
/// `before` to what is there now.
void take_changes(std::span<const int64_t> now, size_t first, size_t count,
                  std::span<int64_t> before, SparseRow& out) {
  for (size_t i = first; i < first + count; ++i)
    if (const int64_t more = now[i] - before[i]) {
      out.at.push_back(i);
      out.value.push_back(more);
      before[i] = now[i];
    }
}

/// The marked sums that differ from `before`. Clears the marks. `before` may end early, followed by
/// zeros, and is set to the present sums.
SparseRow take_discs(State& s, std::vector<int64_t>& before) {
  using estimate::EnergySums;
  SparseRow out{s.discs.sums.size(), {}, {}};
  before.resize(s.discs.sums.size());
  if (s.discs.sums.empty()) return out;
  const size_t n = s.samples.size(), blocks = EnergySums::marks_of_slab(n);
  for (size_t i = 0; i < s.discs.sum_marks.size(); ++i) {
    if (!s.discs.sum_marks[i]) continue;
    const size_t slab = i / blocks, begin = i % blocks * EnergySums::kMarked;
    const size_t count = std::min(n - begin, EnergySums::kMarked);
    take_changes(s.discs.sums, 3 * (slab * n + begin), 3 * count, before, out);
    s.discs.sum_marks[i] = 0;
  }
  return out;
}

/// The same for the touched cells.
SparseRow take_cells(gather::CellSums& sums, std::vector<int64_t>& before) {
  const size_t each = sums.at(1, 0, 0);
  SparseRow out{sums.quanta.size(), {}, {}};
  before.resize(sums.quanta.size());
  for (size_t cell = 0; cell < sums.touched.size(); ++cell) {
    if (!sums.touched[cell]) continue;
    take_changes(sums.quanta, cell * each, each, before, out);
    sums.touched[cell] = 0;
  }
  return out;
}

}  // namespace

PathSums Exchange::path_sums() const {
  const State& s = state_;
  check_whole(s);
  uint64_t paths = s.paths.held.size();
  for (const PathRange& range : s.sharing.added) paths += s.held_of(range).size();
  PathSums out{paths, in_given_order(s.discs.sums, 3, s.given), {}};
  if (s.gathers()) out.cells = s.cells.sums.quanta;
  return out;
}

PathChanges Exchange::path_changes() {
  State& s = state_;
  check_whole(s);
  if (!s.baked || s.evaluates())
    throw OptionError(
        "path_changes: found a session that is not baked or evaluates light, expected a baked one "
        "with a path_range that has paths");
  // If memory runs out below, nothing counts as sent, and the next changes are those of all sums.
  std::unique_ptr<SentSums> sent = std::move(s.sharing.sent);
  const bool first = !sent;
  PathChanges out;
  out.edits = s.edits;
  if (first)
    sent = std::make_unique<SentSums>();
  else
    out.since = sent->edits;
  if (out.since != out.edits) out.ranges = {*s.options.range};
  sent->edits = s.edits;
  sent->groups = s.cell_groups();
  if (first) s.discs.sum_marks.assign(s.discs.sums.empty() ? 0 : s.discs.mark_count(), 1);
  out.discs = take_discs(s, sent->discs);
  if (s.gathers()) {
    gather::CellSums& sums = s.cells.sums;
    if (first) s.cells.touch_all();
    out.cells = take_cells(sums, sent->cells);
  }
  if (first && s.counts_openness()) out.openness = own_openness(s);
  s.sharing.sent = std::move(sent);
  return out;
}

void Exchange::add_path_changes(const PathChanges& more) {
  State& s = state_;
  check_whole(s);
  if (!s.baked || !s.holds_none())
    throw OptionError(
        "add_path_changes: found a session that holds paths or is not baked, expected a baked one "
        "of path_range=(0, 0)");
  check_row("discs", more.discs, s.discs.sums.size());
  check_row("cells", more.cells, s.gathers() ? s.cells.sums.quanta.size() : 0);
  const bool tells_openness = !more.since && s.counts_openness();
  check_openness(more.openness, tells_openness ? s.samples.size() : 0);
  const bool rest = more.since == more.edits && more.ranges.empty();
  if (more.edits != s.edits || !(rest || more.since == s.sharing.added_since))
    throw OptionError("add_path_changes: found changes " + states(more.since, more.edits) +
                      ", expected those " + states(s.sharing.added_since, s.edits) +
                      "; update all sessions by the same edits, and add the path_changes of each");
  std::vector<PathRange> added = s.sharing.added;
  for (const PathRange& range : more.ranges) add_range(range, s.options.paths, added);
  for (size_t i = 0; i < more.discs.at.size(); ++i)
    s.discs.sums[more.discs.at[i]] += more.discs.value[i];
  s.sharing.added = std::move(added);
  if (tells_openness) {
    for (size_t i = 0; i < more.openness.at.size(); ++i)
      s.discs.openness[more.openness.at[i]] = to_float(more.openness.value[i]);
    if (s.has_all_sums()) {
      s.discs.openness_complete = true;
      s.discs.refresh_areas(nullptr);
    }
  }
  if (!s.gathers()) return;
  gather::CellSums& sums = s.cells.sums;
  const size_t each = sums.at(1, 0, 0);
  for (size_t i = 0; i < more.cells.at.size(); ++i) {
    sums.quanta[more.cells.at[i]] += more.cells.value[i];
    sums.touched[more.cells.at[i] / each] = 1;
  }
  s.rays.glance.stale = true;
}

}  // namespace deltalux::session
