// SPDX-License-Identifier: Apache-2.0
// What sessions that share the paths of a bake tell each other: what their paths bring, as integers
// that add up to those of all paths, and numbers of gather rays.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gather/aim/sample_rays.h"
#include "session/world/held_paths.h"

namespace deltalux::session {

/// Sums in quanta.
struct PathSums {
  uint64_t paths = 0;  ///< number of paths that they are of
  /// [((group * kBatches + batch) * samples + sample) * 3 + channel], samples as given by the user
  std::vector<int64_t> discs;
  std::vector<int64_t> cells;  ///< as gather::CellSums; empty without a final gather
};

/// The numbers of a row of `size` that are not zero: their places, ascending, and their values.
struct SparseRow {
  uint64_t size = 0;
  std::vector<uint64_t> at;
  std::vector<int64_t> value;
};

/// What the sums of a session changed from one state to a later one. Those of ranges add up.
struct PathChanges {
  /// The ranges of the paths whose sums this brings into the later state; none if both states have
  /// the same edits, as between two parts of an update with a time budget.
  std::vector<PathRange> ranges;
  uint64_t edits = 0;             ///< number of edits since the bake, of the later state
  std::optional<uint64_t> since;  ///< of the earlier state; nullopt: there was none, all sums are 0
  SparseRow discs;                ///< places in DiscLayer::sums
  SparseRow cells;                ///< places in gather::CellSums
  /// Where `since` has no value and openness counts: the bits of what this part computed of
  /// DiscSets::openness; of no length otherwise.
  SparseRow openness;
};

/// What gradients are made of: sums of the paths on discs, 3 per slab and sample, and their first
/// moments, 6 (see estimate::EnergySums); samples as given by the user.
struct SlopeSums {
  std::vector<int64_t> discs, moments;
};

/// Of a range of the samples: how often each doubles the standard number of its gather rays, and
/// the guides that it sees (empty if there are no guides).
struct RayNumbers {
  std::vector<gather::SeenTargets> seen;
  std::vector<int8_t> doublings;
};

/// Sums of `width` numbers for each slab and sample: from the order of World::samples into that in
/// which the user gave the samples. `given`: World::given.
std::vector<int64_t> in_given_order(std::span<const int64_t> own, size_t width,
                                    std::span<const uint32_t> given);
/// Adds sums in the user's order to sums in the order of World::samples.
void add_in_given_order(std::span<const int64_t> sums, size_t width,
                        std::span<const uint32_t> given, std::span<int64_t> own);

}  // namespace deltalux::session
