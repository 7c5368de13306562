// SPDX-License-Identifier: Apache-2.0
// Predicts what a disc method costs: counts of its tests times the machine's constants. All
// functions are pure. pilot.h predicts counts, calibration.h measures constants.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace deltalux::plan {

/// The disc methods; all of them give the same sums. `automatic` leaves the choice to the planner.
enum class Method : uint8_t { automatic, brute_force, disc_index, ray_map, sphere_cache };
inline constexpr std::array kMethods{Method::brute_force, Method::disc_index, Method::ray_map,
                                     Method::sphere_cache};

/// All operations that take time in a search; no method does all of them.
enum Count : uint8_t {
  kSegments,     ///< segments passed to the method
  kVisits,       ///< discs that the method visits, again in every call
  kNodeTests,    ///< disc index: nodes visited; ray map: segments sorted into halves of a cell
  kDiscTests,    ///< segment-disc tests; eight at a time in the disc index
  kSphereTests,  ///< t of the paper: segment against sphere
  kFarTests,     ///< sphere cache: doublings of a list beyond kNear, in each sphere test of it
  kBoxTests,     ///< ray map: discs that reached a node
  kRebuilds,     ///< sphere cache: lists built
  kSplits,       ///< ray map: leaves split
  /// Brute force: disc tests after a disc with a different normal, where branch prediction fails.
  kTurns,
  kHits,
  kOutlineTests,  ///< on hits of the circles of clipped discs
  kFarHits,       ///< sphere cache: doublings of a call's segments beyond kNear, for each hit
  kCounts
};
/// Number of segments that fit into a core's own cache: the sphere cache's list of them takes two
/// megabytes.
inline constexpr double kNear = 1 << 16;
/// Numbers by kind of count; estimates, so not necessarily integers.
using Counts = std::array<double, kCounts>;

/// The cost of each count of one method, in seconds, for arrays of about this size.
struct Constants {
  /// Discs for the disc index and brute force; segments per call for the other methods.
  double size = 0;
  Counts seconds{};
  double build = 0;  ///< seconds per disc to build the estimator
};
/// Constants of one method, by ascending size.
using MethodConstants = std::vector<Constants>;
/// Indexed by Method; empty for `automatic`.
using Machine = std::array<MethodConstants, 5>;

/// Constants of a machine like the one that the project was developed on, for one array size each;
/// the prior of the calibration.
Machine typical_machine();

/// Constants at `size`: linear in its logarithm between measured sizes. Extrapolated beyond the
/// largest size, since caches miss more and more, but never decreasing.
Constants constants_at(const MethodConstants& constants, double size);

/// Predicted CPU time in seconds.
double search_seconds(const Counts& counts, const Constants& constants);

/// The size with which the constants of a method are looked up.
double size_of(Method method, double discs, double span);

/// Memory of a method in bytes, without discs and sums: what it keeps between calls, and what a
/// call with `span` segments needs.
double method_bytes(Method method, double discs, double span);

}  // namespace deltalux::plan
