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

namespace {

/// By sample from `first` to `last` of `s`: how often it doubles the standard number of rays.
std::vector<int8_t> doublings_of_samples(const State& s, State& c, size_t first, size_t last,
                                         Progress& progress) {
  const std::vector<uint32_t> fixed = fixed_samples(s);
  const auto index_of = [&](size_t sample) {
    return size_t(std::lower_bound(fixed.begin(), fixed.end(), sample) - fixed.begin());
  };
  const size_t begin = index_of(first), end = index_of(last);
  const std::vector<int8_t> own =
      choose_doublings(c, begin, end, c.rays.evaluation(false), progress);
  std::vector<int8_t> out(last - first);
  for (size_t i = begin; i < end; ++i) out[fixed[i] - first] = own[i - begin];
  return out;
}

}  // namespace

void choose_guiding(State& s, Progress& progress) {
  if (!s.gathers()) return;
  s.direct.choose_scales();
  std::unique_ptr<State> c = choice_state(s, progress);
  choose_need(*c, choose_guides(*c, progress));
  c->paths.store = {};  // their light is in the cells
  gather::Guiding guiding = c->rays.guiding;
  if (s.holds_all())
    guiding.doublings = doublings_of_samples(s, *c, 0, s.samples.size(), progress);
  else
    s.sharing.choices = std::move(c);
  s.rays.guiding = std::move(guiding);
}

std::vector<int8_t> choose_all_doublings(State& s, Progress& progress) {
  if (!s.sharing.choices) choose_guiding(s, progress);
  std::vector<int8_t> out =
      doublings_of_samples(s, *s.sharing.choices, 0, s.samples.size(), progress);
  s.sharing.choices.reset();
  return out;
}

RayNumbers number_rays(State& s, size_t first, size_t last, Progress& progress) {
  if (!s.sharing.choices) choose_guiding(s, progress);
  RayNumbers out{{}, doublings_of_samples(s, *s.sharing.choices, first, last, progress)};
  if (!s.rays.guiding.empty()) progress.begin("share rays", last - first);
  out.seen = s.rays.targets_at(std::span(s.direct.receivers).subspan(first, last - first),
                               s.options.gather_rays, progress);
  return out;
}

}  // namespace deltalux::session
