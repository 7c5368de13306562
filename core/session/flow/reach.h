// SPDX-License-Identifier: Apache-2.0
// Where edits may put objects: anywhere in scenes without suns, and where a sun's paths pass.
#pragma once
#include <string>
#include <vector>

#include "base/vec.h"
#include "lights/kind.h"
#include "session/state/state.h"

namespace deltalux::session {

/// No edit changes it. May be used while the session works.
class Reach {
 public:
  explicit Reach(const State& state);
  /// Why no object can have these bounds, as the end of a sentence that begins with its name; empty
  /// if one can.
  std::string refusal(const Box& bounds) const;

 private:
  Box first_;                           // Scene::first_world()
  std::vector<lights::Punctual> suns_;  // that no object carries
  bool turning_suns_ = false;           // whether objects carry suns
  bool shared_;  // whether other sessions hold paths, which would have to begin anew
};

}  // namespace deltalux::session
