// SPDX-License-Identifier: Apache-2.0
// What must hold before results are read or edits are applied.
#include "session/state/state.h"

#include <string>

#include "base/error.h"

namespace deltalux::session {

void SentSums::set_groups(uint32_t count) {
  gather::regroup(cells, kBatches, groups, count);
  groups = count;
}

void check_whole(const State& s) {
  DELTALUX_ASSERT(s.step == Step::rest);
  if (s.damaged)
    throw Error(
        "session: memory ran out in the middle of an update, and again when everything was "
        "to be computed anew; free memory, then call update() or recompute()");
}

void check_added(const State& s) {
  if (s.holds_none() && !s.has_all_sums())
    throw OptionError("session: found the sums of " + std::to_string(s.sharing.added_paths()) +
                      " paths after " + std::to_string(s.edits) + " edits, expected those of all " +
                      std::to_string(s.options.paths) + "; add the path_changes of all ranges");
}

void check_gathered(const State& s) {
  if (s.sharing.awaited_direct)
    throw OptionError(
        "session: it lacks direct light of some samples; call take_direct() for them");
  if (s.baked && s.holds_none() && !s.rays.all_cast())
    throw OptionError(
        "session: its gather rays are not cast yet; call gather() once the sums of all paths are "
        "added");
}

void check_readable(const State& s) {
  check_whole(s);
  if (!s.evaluates())
    throw OptionError("session: it holds paths " + std::to_string(s.options.range->first) + " to " +
                      std::to_string(s.options.range->last) + " of " +
                      std::to_string(s.options.paths) +
                      " (path_range), and light is that of all; add the path_changes of all ranges "
                      "to a session of path_range=(0, 0), and read that");
  check_added(s);
  check_gathered(s);
}

}  // namespace deltalux::session
