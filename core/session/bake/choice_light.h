// SPDX-License-Identifier: Apache-2.0
// The light in which a bake chooses guides and numbers of rays: lamps that are off or dimmed count
// as brighter than they are, since an edit may light them.
#pragma once
#include <utility>
#include <vector>

#include "session/state/state.h"

namespace deltalux::session {

/// Dim factors by light group for these choices: the present ones, but a dimmed group is raised,
/// at most to its full light, until it brings a quarter of the present light. Needs the cells'
/// sums.
std::vector<double> choice_factors(const State& state);

/// Puts other dim factors into the state for as long as this lives.
class ChoiceLight {
 public:
  ChoiceLight(State& state, std::vector<double> factors)
      : state_(state), other_(std::move(factors)) {
    std::swap(state_.group_factor, other_);
  }
  ChoiceLight(const ChoiceLight&) = delete;
  ChoiceLight& operator=(const ChoiceLight&) = delete;
  ~ChoiceLight() { std::swap(state_.group_factor, other_); }

 private:
  State& state_;
  std::vector<double> other_;
};

}  // namespace deltalux::session
