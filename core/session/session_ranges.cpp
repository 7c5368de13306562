// SPDX-License-Identifier: Apache-2.0
// Sessions that share the paths of one bake: sums of ranges, and a session without paths that
// evaluates the sums of all ranges.
#include <algorithm>
#include <functional>

#include "base/error.h"
#include "gather/beam.h"
#include "session/session.h"

namespace deltalux::session {
namespace {

/// The lights that choose_guides() may choose, since they are narrow or parallel.
std::vector<uint32_t> candidates(const State& s) {
  const std::vector<uint8_t> asked = s.asked_for();
  std::vector<uint32_t> lights;
  for (uint32_t i = 0; i < s.lights.size(); ++i) {
    const trace::Light& light = s.lights[i];
    if (light.on && !asked[i] && (light.is_parallel() || gather::Beam::is_narrow(light)))
      lights.push_back(i);
  }
  return lights;
}

void check_size(const char* name, size_t found, size_t expected) {
  if (found != expected)
    throw OptionError(std::string(name) + ": found " + std::to_string(found) +
                      " numbers, expected " + std::to_string(expected) +
                      "; give those of sessions of the same scene, samples, options and edits");
}

}  // namespace

PathSums Session::path_sums() const {
  check_whole();
  const State& s = *state_;
  PathSums out{s.held.size() + s.added_paths, in_given_order(s.sums, 3, s.given), {}};
  if (s.gather) out.cells = s.gather->sums.quanta;
  return out;
}

void Session::add_path_sums(const PathSums& more) {
  check_whole();
  State& s = *state_;
  if (!baked_ || !s.holds_none())
    throw OptionError(
        "add_path_sums: found a session that holds paths or is not baked, expected a baked one of "
        "path_range=(0, 0)");
  check_size("discs", more.discs.size(), s.sums.size());
  check_size("cells", more.cells.size(), s.gather ? s.gather->sums.quanta.size() : 0);
  if (more.paths > s.all_paths() - s.added_paths)
    throw OptionError("add_path_sums: found sums of " + std::to_string(more.paths) +
                      " paths beside those of " + std::to_string(s.added_paths) +
                      ", expected at most " + std::to_string(s.all_paths()) +
                      " in all; add each range once, and after an edit only differences");
  add_in_given_order(more.discs, 3, s.given, s.sums);
  s.added_paths += more.paths;
  if (!s.gather) return;
  gather::CellSums& sums = s.gather->sums;
  const size_t each = sums.at(1, 0, 0);
  for (size_t i = 0; i < more.cells.size(); ++i) {
    if (!more.cells[i]) continue;
    sums.quanta[i] += more.cells[i];
    sums.touched[i / each] = 1;
  }
  s.gather->glance.stale = true;
}

FirstFlights Session::first_flights() const {
  check_whole();
  const State& s = *state_;
  FirstFlights out;
  if (!s.gather || !baked_) return out;
  out.lights = candidates(s);
  const size_t each = 3 * size_t(kBatches) * s.gather->cells.size();
  out.quanta.resize(out.lights.size() * each);
  if (s.store.bounces().empty()) return out;
  std::vector<int64_t*> place(s.lights.size());
  for (size_t k = 0; k < out.lights.size(); ++k) place[out.lights[k]] = &out.quanta[k * each];
  const segments::BounceSegments& first = s.store.bounces()[0];
  for (uint32_t slot = 0; slot < first.size(); ++slot) {
    const segments::Segment& segment = first.at(slot);
    const uint32_t cell = segment.length < 0 ? gather::kNoCell : first.landing(slot);
    const size_t number = s.light_of(segment.path);
    if (cell == gather::kNoCell || !place[number]) continue;
    const trace::Light& light = s.lights[number];
    const uint32_t batch = trace::batch_of(light, segment.path - light.first_path, kBatches);
    for (size_t c = 0; c < 3; ++c)
      place[number][3 * (size_t(cell) * kBatches + batch) + c] += segment.power[c];
  }
  return out;
}

void Session::leave_out(uint32_t light, const FirstFlights& flights) {
  State& s = *state_;
  gather::CellSums& sums = s.gather->sums;
  const std::span<const int64_t> own = flights.of(light);
  const uint32_t group = s.sum_group(s.lights[light].group);
  const size_t batches = 3 * size_t(kBatches);  // numbers of a cell
  for (size_t i = 0; i < own.size(); ++i) {
    if (!own[i]) continue;
    const auto cell = uint32_t(i / batches);
    sums.quanta[sums.at(cell, group, 0) + i % batches] -= own[i];
    sums.touched[cell] = 1;
  }
}

void Session::look(const FirstFlights& others, Progress& progress) {
  State& s = *state_;
  check_whole();
  if (!baked_ || !s.holds_none())
    throw OptionError(
        "look: found a session that holds paths or is not baked, expected a baked one of "
        "path_range=(0, 0)");
  check_added();
  if (!s.gather || looked()) return;
  if (others.lights != candidates(s))
    throw OptionError(
        "look: found first flights of other lights than the narrow and parallel ones of the "
        "scene; give the sum of the first_flights of all ranges");
  check_size("first_flights", others.quanta.size(),
             others.lights.size() * 3 * kBatches * s.gather->cells.size());
  const gather::CellSums before = s.gather->sums;
  const Forecast forecast = forecast_;
  try {
    look_around(progress, true, others);
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

std::vector<uint32_t> Session::asked_lights() const {
  const std::vector<uint8_t> asked = state_->asked_for();
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
  for (const uint32_t light : lights) leave_out(light, own);
}

bool Session::looked() const {
  const State& s = *state_;
  return !s.gather || s.gather->looks.samples() == s.samples.size();
}

void Session::check_added() const {
  const State& s = *state_;
  if (s.holds_none() && s.added_paths != s.all_paths())
    throw OptionError("session: found sums of " + std::to_string(s.added_paths) +
                      " paths, expected those of all " + std::to_string(s.all_paths()) +
                      "; add the path_sums of all ranges");
}

void Session::check_looked() const {
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
                      " (path_range), and light is that of all; add the path_sums of all ranges to "
                      "a session of path_range=(0, 0), and read that");
  check_added();
  check_looked();
}

}  // namespace deltalux::session
