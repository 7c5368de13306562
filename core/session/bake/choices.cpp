// SPDX-License-Identifier: Apache-2.0
// Samples on movables cast the standard number of rays, since their surroundings may change.
#include "session/bake/choices.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "session/bake/choice_state.h"
#include "session/bake/choose_guides.h"
#include "session/bake/choose_rays.h"

namespace deltalux::session {

void choose_guiding(State& s, Progress& progress) {
  if (!s.gathers()) return;
  s.direct.choose_scales();
  std::unique_ptr<State> c = choice_state(s, progress);
  choose_need(*c, choose_guides(*c, progress));
  s.rays.guiding = c->rays.guiding;
  c->paths.store = {};  // their light is in the cells
  s.sharing.choices = std::move(c);
}

RayNumbers number_rays(State& s, size_t first, size_t last, Progress& progress) {
  if (!s.sharing.choices) choose_guiding(s, progress);
  State& c = *s.sharing.choices;
  const std::vector<uint32_t> fixed = fixed_samples(s);
  const auto index_of = [&](size_t sample) {
    return size_t(std::lower_bound(fixed.begin(), fixed.end(), sample) - fixed.begin());
  };
  const size_t begin = index_of(first), end = index_of(last);
  const std::vector<int8_t> own =
      choose_doublings(c, begin, end, c.rays.evaluation(false), progress);
  RayNumbers out{{}, std::vector<int8_t>(last - first)};
  for (size_t i = begin; i < end; ++i) out.doublings[fixed[i] - first] = own[i - begin];
  if (!s.rays.guiding.empty()) progress.begin("share rays", last - first);
  out.seen = s.rays.targets_at(std::span(s.direct.receivers).subspan(first, last - first),
                               s.options.gather_rays, progress);
  return out;
}

std::vector<gather::SeenTargets> choose_numbers(State& s, Progress& progress) {
  RayNumbers numbers = number_rays(s, 0, s.samples.size(), progress);
  s.sharing.choices.reset();
  s.rays.guiding.doublings = std::move(numbers.doublings);
  fit_rays(s);
  return std::move(numbers.seen);
}

}  // namespace deltalux::session
