// SPDX-License-Identifier: Apache-2.0
// What a disc method costs: counts of its tests times the machine's constants. Pure functions of
// numbers; pilot.h counts, calibration.h measures the constants.
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

/// Everything that takes time in a search; no method does all of it.
enum Count : uint8_t {
  kSegments,     ///< brought to the method
  kVisits,       ///< discs that the method goes through, in every call anew
  kNodeTests,    ///< disc index: nodes visited; ray map: segments sorted into halves of a cell
  kDiscTests,    ///< segment against disc; of the disc index eight at a time
  kSphereTests,  ///< t of the paper: segment against sphere
  kFarTests,     ///< sphere cache: doublings of a list beyond kNear, in each sphere test of it
  kBoxTests,     ///< ray map: discs that came to a node
  kRebuilds,     ///< sphere cache: lists built
  kSplits,       ///< ray map: leaves split
  kTurns,        ///< brute force: disc tests after a disc that faces elsewhere; branches miss
  kHits,
  kOutlineTests,  ///< of hits on the circles of clipped discs
  kFarHits,       ///< sphere cache: doublings of a call's segments beyond kNear, for each hit
  kCounts
};
/// Segments that a core's own cache holds: the sphere cache's list of them takes two megabytes.
inline constexpr double kNear = 1 << 16;
/// Of one kind each; estimates, so they need not be whole.
using Counts = std::array<double, kCounts>;

/// Seconds per count of one method while its arrays have about this size.
struct Constants {
  double size = 0;  ///< discs of the disc index and brute force, segments of a call of the others
  Counts seconds{};
  double build = 0;  ///< seconds per disc to make the estimator
};
/// Of one method, by ascending size.
using MethodConstants = std::vector<Constants>;
/// Indexed by Method; that of `automatic` is empty.
using Machine = std::array<MethodConstants, 5>;

/// Constants of a machine like the one that the project was developed on, for one array size each.
/// What calibration starts from.
Machine typical_machine();

/// Constants at `size`: linear in its logarithm between the sizes that were measured. Beyond the
/// largest one the last slope goes on, as caches keep missing more, but never downwards.
Constants constants_at(const MethodConstants& constants, double size);

/// Seconds of processor time.
double search_seconds(const Counts& counts, const Constants& constants);

/// The size by which constants of a method are looked up.
double size_of(Method method, double discs, double span);

/// Memory of a method beside the discs and the sums, bytes: what stands between calls and what a
/// call over `span` segments takes.
double method_bytes(Method method, double discs, double span);

}  // namespace deltalux::plan
