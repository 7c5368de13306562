// SPDX-License-Identifier: Apache-2.0
// Direct light of a picture's places, kept for the next one where no shadow came or went.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "direct/light_shape.h"
#include "gather/looks.h"

namespace deltalux::session {

class KeptDirect {
 public:
  /// Null where it is not kept. `by_need`: as direct::light_by_need finds it.
  const Vec3d* find(const direct::Receiver& receiver, bool by_need) const;
  void keep(const direct::Receiver& receiver, bool by_need, Vec3d light);
  /// Notes an edit.
  void note(const gather::Change& change);
  /// Forgets what edits may have changed, and what was not asked for since the last one. `dim`: per
  /// light. `slack`: see direct::slack.
  void follow_changes(std::span<const trace::Light> lights, std::span<const double> dim,
                      float slack);
  size_t bytes() const;

 private:
  struct Kept {
    direct::Receiver receiver;
    Vec3d light;
    mutable bool used = true;
  };
  static uint64_t key_of(const direct::Receiver& receiver, bool by_need);

  std::unordered_map<uint64_t, Kept> places_;
  std::vector<double> dim_;               // that it was found with
  std::optional<gather::Change> change_;  // since the last picture
};

}  // namespace deltalux::session
