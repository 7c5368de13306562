// SPDX-License-Identifier: Apache-2.0
// The standard error of samples that no path of a light group has reached, or hardly any: the
// spread of their batches says nothing.
#pragma once
#include <vector>

#include "base/vec.h"
#include "session/state/state.h"

namespace deltalux::session {

/// Estimates the error of a sample without any hit as the smaller of two values. First, the power
/// of one path, which the sample would count with one hit. Second, the sample's share, by area, of
/// the light that all unreached samples miss together, which is about what samples with exactly one
/// hit received (Good 1953, Biometrika 40). The second matters in slits, where a few square
/// millimetres of a disc may be uncovered and one path would outshine the room. A pure function of
/// the state.
class UnreachedError {
 public:
  explicit UnreachedError(const State& state);
  /// The error in power, per channel, of a sample whose disc counts `area`.
  Vec3d at(uint32_t sum_group, double area) const;

 private:
  struct Group {
    // Power of a path where it first counts, averaged over the paths of the group.
    Vec3d one{};
    // Power per square metre that unreached samples miss.
    Vec3d density{};
  };
  std::vector<Group> groups_;
};

/// Number of present samples that no path and no gather ray with light has reached. Throws like
/// check_readable().
size_t count_unreached(const State& state);

}  // namespace deltalux::session
