// SPDX-License-Identifier: Apache-2.0
// Sessions that share the paths of one bake: sums of ranges, and a session without paths that
// evaluates the sums of all ranges.
#include <algorithm>
#include <bit>
#include <functional>
#include <utility>

#include "base/error.h"
#include "gather/aim/beam.h"
#include "samples/openness.h"
#include "session/session.h"

namespace deltalux::session {
namespace {

/// The lights that choose_guides() may choose, since they are narrow or parallel.
std::vector<uint32_t> candidates(const State& s) {
  const std::vector<uint8_t> asked = s.lights_by_shadow_ray();
  std::vector<uint32_t> lights;
  for (uint32_t i = 0; i < s.lights.size(); ++i) {
    const trace::Light& light = s.lights[i];
    if (light.on && !asked[i] && (light.is_parallel() || gather::Beam::is_narrow(light)))
      lights.push_back(i);
  }
  return lights;
}

constexpr const char* kSame =
    "; give those of sessions of the same scene, samples, options and edits";

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

/// Throws OptionError unless these are first flights of `lights` to so many cells.
void check_flights(const FirstFlights& flights, const std::vector<uint32_t>& lights,
                   uint64_t cells) {
  if (flights.lights != lights)
    throw OptionError(
        "look: found first flights of other lights than the narrow and parallel ones of the "
        "scene; give the sum of the first_flights of all ranges");
  if (flights.cells != cells || flights.at.size() != flights.quanta.size() ||
      std::adjacent_find(flights.at.begin(), flights.at.end(), std::greater_equal{}) !=
          flights.at.end() ||
      (!flights.at.empty() && flights.at.back() >= lights.size() * cells * kBatches))
    throw OptionError("look: found first flights to " + std::to_string(flights.cells) +
                      " cells, or not in order, expected " + std::to_string(cells) + kSame);
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

void Session::Told::set_groups(uint32_t count) {
  gather::regroup(cells, kBatches, groups, count);
  groups = count;
}

PathSums Session::path_sums() const {
  check_whole();
  const State& s = *state_;
  uint64_t paths = s.paths.held.size();
  for (const PathRange& range : s.added) paths += s.held_of(range).size();
  PathSums out{paths, in_given_order(s.discs.sums, 3, s.given), {}};
  if (s.gather) out.cells = s.gather->sums.quanta;
  return out;
}

PathChanges Session::path_changes() {
  check_whole();
  State& s = *state_;
  if (!baked_ || s.evaluates())
    throw OptionError(
        "path_changes: found a session that is not baked or evaluates light, expected a baked one "
        "with a path_range that has paths");
  // If memory runs out below, nothing counts as told, and the next changes are those of all sums.
  std::unique_ptr<Told> told = std::move(told_);
  const bool first = !told;
  PathChanges out;
  out.edits = s.edits;
  if (first)
    told = std::make_unique<Told>();
  else
    out.since = told->edits;
  if (out.since != out.edits) out.ranges = {*s.options.range};
  told->edits = s.edits;
  told->groups = uint32_t(s.sum_groups.size());
  if (first) s.discs.sum_marks.assign(s.discs.sums.empty() ? 0 : s.discs.mark_count(), 1);
  out.discs = take_discs(s, told->discs);
  if (s.gather) {
    gather::CellSums& sums = s.gather->sums;
    if (first) std::fill(sums.touched.begin(), sums.touched.end(), uint8_t(1));
    out.cells = take_cells(sums, told->cells);
  }
  if (first && s.counts_openness()) out.openness = own_openness(s);
  told_ = std::move(told);
  return out;
}

void Session::add_path_changes(const PathChanges& more) {
  check_whole();
  State& s = *state_;
  if (!baked_ || !s.holds_none())
    throw OptionError(
        "add_path_changes: found a session that holds paths or is not baked, expected a baked one "
        "of path_range=(0, 0)");
  check_row("discs", more.discs, s.discs.sums.size());
  check_row("cells", more.cells, s.gather ? s.gather->sums.quanta.size() : 0);
  const bool tells_openness = !more.since && s.counts_openness();
  check_openness(more.openness, tells_openness ? s.samples.size() : 0);
  const bool rest = more.since == more.edits && more.ranges.empty();
  if (more.edits != s.edits || !(rest || more.since == s.added_since))
    throw OptionError("add_path_changes: found changes " + states(more.since, more.edits) +
                      ", expected those " + states(s.added_since, s.edits) +
                      "; update all sessions by the same edits, and add the path_changes of each");
  std::vector<PathRange> added = s.added;
  for (const PathRange& range : more.ranges) add_range(range, s.options.paths, added);
  for (size_t i = 0; i < more.discs.at.size(); ++i)
    s.discs.sums[more.discs.at[i]] += more.discs.value[i];
  s.added = std::move(added);
  if (tells_openness) {
    for (size_t i = 0; i < more.openness.at.size(); ++i)
      s.discs.openness[more.openness.at[i]] = to_float(more.openness.value[i]);
    if (has_all_sums()) {
      s.discs.openness_complete = true;
      s.discs.refresh_areas(nullptr);
    }
  }
  if (!s.gather) return;
  gather::CellSums& sums = s.gather->sums;
  const size_t each = sums.at(1, 0, 0);
  for (size_t i = 0; i < more.cells.at.size(); ++i) {
    sums.quanta[more.cells.at[i]] += more.cells.value[i];
    sums.touched[more.cells.at[i] / each] = 1;
  }
  s.gather->glance.stale = true;
}

size_t Session::forecast_sharing() const {
  const State& s = *state_;
  if (!s.options.range) return 0;
  size_t sum = s.holds_none() ? 0 : sizeof(int64_t) * s.discs.sum_count();
  if (!s.gather) return sum;
  if (!s.holds_none())  // what path_changes() returned; what gather rays cast for others need
    sum += s.gather->sums.quanta.size() * sizeof(int64_t) +
           s.samples.size() * sizeof(direct::Receiver) +
           gather::CellLight::forecast_bytes(s.gather->cells.size());
  for (const uint32_t light : candidates(s)) {
    uint64_t paths = s.holds_none() ? s.lights[light].path_count : 0;
    s.paths.held.each_of(s.lights[light], [&](uint64_t) { ++paths; });
    sum += FirstFlights::kBytesPerPath * paths;
  }
  return sum;
}

void Session::count_edits(size_t edits, bool complete) {
  State& s = *state_;
  if (!edits) return;
  if (complete) s.added_since = s.edits;
  s.edits += edits;
  s.added.clear();
}

uint64_t Session::added_paths() const {
  uint64_t paths = 0;
  for (const PathRange& range : state_->added) paths += range.last - range.first;
  return paths;
}

FirstFlights Session::first_flights() const {
  check_whole();
  const State& s = *state_;
  FirstFlights out;
  if (!s.gather || !baked_) return out;
  out.lights = candidates(s);
  out.cells = s.gather->cells.size();
  if (s.paths.store.bounces().empty()) return out;
  const segments::BounceSegments& first = s.paths.store.bounces()[0];
  std::vector<std::pair<uint64_t, FirstFlights::Quanta>> landed;
  for (size_t k = 0; k < out.lights.size(); ++k) {
    const trace::Light& light = s.lights[out.lights[k]];
    landed.clear();
    s.paths.held.each_of(light, [&](uint64_t i) {
      const uint32_t slot = s.paths.held.slot_of(uint32_t(light.first_path + i));
      const segments::Segment& segment = first.at(slot);
      const uint32_t cell = segment.length < 0 ? gather::kNoCell : first.landing(slot);
      if (cell == gather::kNoCell) return;
      const uint32_t batch = trace::batch_of(light, i, kBatches);
      landed.push_back({(k * out.cells + cell) * kBatches + batch,
                        {segment.power[0], segment.power[1], segment.power[2]}});
    });
    std::sort(landed.begin(), landed.end());
    for (const auto& [place, quanta] : landed) {
      if (out.at.empty() || out.at.back() != place)
        out.at.push_back(place), out.quanta.push_back({});
      for (size_t c = 0; c < 3; ++c) out.quanta.back()[c] += quanta[c];
    }
  }
  return out;
}

void Session::leave_out(uint32_t light, const FirstFlights& flights,
                        std::vector<int64_t>& quanta) const {
  const State& s = *state_;
  const uint32_t group = s.lights[light].sums;
  flights.each_of(light, kBatches, [&](uint64_t place, const FirstFlights::Quanta& own) {
    const size_t at =
        s.gather->sums.at(uint32_t(place / kBatches), group, uint32_t(place % kBatches));
    for (size_t c = 0; c < 3; ++c) quanta[at + c] -= own[c];
  });
}

void Session::leave_out(uint32_t light, const FirstFlights& flights) {
  gather::CellSums& sums = state_->gather->sums;
  leave_out(light, flights, sums.quanta);
  flights.each_of(light, kBatches, [&](uint64_t place, const FirstFlights::Quanta&) {
    sums.touched[place / kBatches] = 1;
  });
}

bool Session::may_look(const FirstFlights& others) const {
  const State& s = *state_;
  check_whole();
  if (!baked_ || !s.holds_none())
    throw OptionError(
        "look: found a session that holds paths or is not baked, expected a baked one of "
        "path_range=(0, 0)");
  check_added();
  if (looking_)
    throw OptionError(
        "look: found a session that waits for gather rays of others; add those that it lacks, or "
        "bake again");
  if (!s.gather || looked()) return false;
  if (awaited_direct_) check_looked();
  check_flights(others, candidates(s), s.gather->cells.size());
  return true;
}

void Session::choose_look(const std::function<void()>& choose) {
  State& s = *state_;
  const gather::CellSums before = s.gather->sums;
  const Forecast forecast = forecast_;
  try {
    choose();
  } catch (...) {
    s.guiding = {};
    s.gather->beams = {}, s.gather->suns = {};
    s.gather->looks = gather::Looks({}, s.options.seed);
    s.gather->sums = before;
    forecast_ = forecast;
    std::fill(s.gather->sums.touched.begin(), s.gather->sums.touched.end(), uint8_t(1));
    throw;
  }
}

void Session::look(const FirstFlights& others, Progress& progress) {
  if (may_look(others)) choose_look([&] { look_around(progress, true, others); });
}

std::vector<uint32_t> Session::asked_lights() const {
  const std::vector<uint8_t> asked = state_->lights_by_shadow_ray();
  std::vector<uint32_t> lights;
  for (uint32_t i = 0; i < asked.size(); ++i)
    if (asked[i]) lights.push_back(i);
  return lights;
}

void Session::ask_for(std::span<const uint32_t> lights) {
  check_whole();
  State& s = *state_;
  const std::vector<uint32_t> known = candidates(s);
  if (std::adjacent_find(lights.begin(), lights.end(), std::greater_equal{}) != lights.end())
    throw OptionError(
        "ask_for: found lights that do not ascend, expected each once; give asked_lights of the "
        "session that looked");
  for (const uint32_t light : lights)
    if (!s.gather || s.evaluates() || !std::binary_search(known.begin(), known.end(), light))
      throw OptionError("ask_for: found light " + std::to_string(light) +
                        ", expected narrow or parallel lights, in a session that gathers and holds "
                        "a part of the paths; give asked_lights of the session that looked");
  if (lights.empty()) return;
  const FirstFlights own = first_flights();
  gather::Guiding fresh = s.guiding;
  for (const uint32_t light : lights)
    if (s.lights[light].is_parallel())
      fresh.suns.push_back(light);
    else
      fresh.beams.push_back({light, 1, 1});
  s.guiding = std::move(fresh);
  for (const uint32_t light : lights) {
    leave_out(light, own);
    if (told_)
      leave_out(light, own, told_->cells);  // the session that adds up the sums subtracts it there
  }
}

bool Session::looked() const {
  const State& s = *state_;
  return !s.gather || s.gather->looks.samples() == s.samples.size();
}

void Session::check_added() const {
  const State& s = *state_;
  if (s.holds_none() && !has_all_sums())
    throw OptionError("session: found the sums of " + std::to_string(added_paths()) +
                      " paths after " + std::to_string(s.edits) + " edits, expected those of all " +
                      std::to_string(s.options.paths) + "; add the path_changes of all ranges");
}

void Session::check_looked() const {
  if (awaited_direct_)
    throw OptionError(
        "session: it lacks direct light of some samples; call take_direct() for them");
  if (baked_ && state_->holds_none() && !looked())
    throw OptionError(
        "session: its gather rays are not cast yet; call look() once the sums of all paths are "
        "added");
}

void Session::check_readable() const {
  const State& s = *state_;
  check_whole();
  if (!s.evaluates())
    throw OptionError("session: it holds paths " + std::to_string(s.options.range->first) + " to " +
                      std::to_string(s.options.range->last) + " of " +
                      std::to_string(s.options.paths) +
                      " (path_range), and light is that of all; add the path_changes of all ranges "
                      "to a session of path_range=(0, 0), and read that");
  check_added();
  check_looked();
}

}  // namespace deltalux::session
