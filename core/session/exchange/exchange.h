// SPDX-License-Identifier: Apache-2.0
// What sessions that share the paths of a bake exchange.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/progress.h"
#include "direct/direct_light.h"
#include "gather/hits/gather_hits.h"
#include "session/shared/path_sums.h"
#include "session/state/state.h"

namespace deltalux::session {

/// The end of messages about what another session gave.
inline constexpr const char* kSame =
    "; give those of sessions of the same scene, samples, options and edits";

// Several sessions of the same scene, samples and options may share the paths by Options::range.
// Those with a part of them trace, store and sum up; they have no light to read. One without
// paths evaluates the sums of all parts: its results, and its digest, are those of a session that
// holds all paths. Bake it like the others, add their sums to it, and call its gather(). All
// sessions get the same edits.
class Exchange {
 public:
  /// Valid until the next bake or recompute, or an edit that changes the world.
  explicit Exchange(State& state) : state_(state) {}

  /// The sums of the paths held here, and of those added.
  PathSums path_sums() const;
  /// What these sums changed since the last call, or since the bake or a recompute: then all of
  /// them. Only for a baked session with a part of the paths. Throws OptionError.
  PathChanges path_changes();
  /// Adds what the sums of paths that other sessions hold changed. Only for a baked session without
  /// paths, which notes the ranges: its light cannot be read before all paths' changes by all edits
  /// are there. Throws OptionError.
  void add_path_changes(const PathChanges& more);
  /// Completes the bake of a session without paths once the sums of all are added: casts gather
  /// rays. Does nothing without a final gather. Throws Cancelled, and leaves the session as it was.
  void gather(Progress& progress);

  // Or the parts do most of what gather() does: begin_gather(); place_samples() of each part;
  // number_rays() of a part for each range of the samples, and take_numbers() of all;
  // cast_gather_rays() of a part and take_hits() for each range. Samples count in the order of
  // World::samples. A gather that was begun and not completed can only be replaced by a bake, or
  // forgotten.

  /// Does nothing without a final gather. Throws Cancelled, and leaves the session as it was.
  void begin_gather(Progress& progress);
  /// Whether a gather was begun and is not complete.
  bool is_gathering() const { return state_.sharing.begun != nullptr; }
  /// The numbers of rays of samples [first, last), which do not depend on edits.
  RayNumbers number_rays(size_t first, size_t last, Progress& progress);
  /// Takes those of all samples.
  void take_numbers(RayNumbers numbers);
  /// Cuts the samples into ranges of about so many rays.
  std::vector<uint64_t> ray_cuts(uint64_t rays) const;
  /// Where the rays of samples [first, last) go. Valid until the session changes.
  ArchiveView save_aims(size_t first, size_t last) const;
  /// What rays that go there meet.
  gather::GatherHits cast_gather_rays(size_t first, size_t last, ArchiveSource& aims,
                                      Progress& progress);
  /// Puts what cast_gather_rays() found, and saved, in place. With the last range, the gather is
  /// complete.
  void take_hits(size_t first, size_t last, ArchiveSource& archive);

  // In the same way, parts may compute direct light after their bake, before the gather begins:
  // place_samples() and cast_direct() of parts, and take_direct().

  /// Prepares a part for casting rays.
  void place_samples();
  /// The direct light of samples [first, last).
  direct::DirectLight cast_direct(size_t first, size_t last, Progress& progress) const;
  /// Puts what cast_direct() found, and saved, in place.
  void take_direct(size_t first, size_t last, ArchiveSource& archive);
  /// Whether a bake left direct light to others, and some is missing.
  bool awaits_direct() const { return state_.sharing.awaited_direct != nullptr; }

 private:
  /// Throws OptionError where a gather cannot begin; returns whether there is anything to do.
  bool may_gather() const;
  /// A gather that was begun. `counted`: whether the numbers of rays must be there, or must not.
  /// Throws OptionError if there is no such gather.
  const BegunGather& begun(std::optional<bool> counted = {}) const;
  /// Throws OptionError in a session whose samples are not placed, or that has no such samples.
  void check_placed(size_t first, size_t last) const;

  State& state_;
};

}  // namespace deltalux::session
