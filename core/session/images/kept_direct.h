// SPDX-License-Identifier: Apache-2.0
// Direct light at the places (pixels) of one rendered image, kept for the next image where no
// shadow appeared or vanished.
#pragma once
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "direct/light_shape.h"
#include "trace/change.h"

namespace deltalux::session {

class KeptDirect {
 public:
  /// The kept light of a place, or null if there is none. `by_need`: whether it was found by
  /// direct::light_by_need.
  const Vec3d* find(const direct::Receiver& receiver, bool by_need) const;
  void keep(const direct::Receiver& receiver, bool by_need, Vec3d light);
  /// Records an edit.
  void note(const trace::Change& change) { change_.merge(change); }
  /// Forgets the light that recorded edits may have changed, and the light of places that were not
  /// all_cast up since the last edit. Forgets everything if a dim factor changed. `dim`: factor of
  /// each light. `slack`: see trace::shadow_slack.
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
  std::vector<double> dim_;  // dim factors that the kept light was found with
  trace::Change change_;     // all edits since the last image
};

}  // namespace deltalux::session
