// SPDX-License-Identifier: Apache-2.0
// The standard error of samples that no path of a light group reached. Their batches agree on 0,
// which proves nothing.
#pragma once
#include <vector>

#include "base/vec.h"
#include "session/state.h"

namespace deltalux::session {

/// What no hit among all paths implies: with one, a sample would count the power of a path, so its
/// error is that much; but no more than its part of what all such samples miss, which is about what
/// those got that were hit once (Good 1953, Biometrika 40). For in a slit a disc of a few square
/// millimetres may be left, where one path would outshine the room. A pure function of the state.
class UnreachedError {
 public:
  explicit UnreachedError(const State& state);
  /// In quanta, per channel, for a sample whose disc counts `area`.
  Vec3d at(uint32_t sum_group, double area) const;

 private:
  struct Group {
    Vec3d one{};      // power of a path where it first counts: mean over the group's lights
    Vec3d density{};  // quanta per square metre that unreached samples miss
  };
  std::vector<Group> groups_;
};

}  // namespace deltalux::session
