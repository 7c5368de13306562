// SPDX-License-Identifier: Apache-2.0
// What cells had counted of the lights chosen here is removed from them.
#include "session/bake/choose_guides.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "gather/choose/find_beams.h"
#include "gather/choose/find_guides.h"
#include "gather/choose/find_portals.h"
#include "session/flow/landings.h"

namespace deltalux::session {
namespace {

/// The suns that are worth a shadow ray at every gather hit. `hits`: see BrightnessSurvey.
std::vector<uint32_t> find_suns(State& s, std::span<const uint32_t> hits) {
  const Landings landings(s);
  const std::vector<trace::Light>& lights = s.lights;
  std::vector<uint32_t> suns;
  for (uint32_t i = 0; i < lights.size(); ++i)
    if (lights[i].is_parallel() && lights[i].on &&
        landings.share_lit_by(i, hits) <= gather::Suns::kMaxLit)
      suns.push_back(i);
  return suns;
}

}  // namespace

gather::Evaluation choose_guides(State& s, Progress& progress) {
  const auto survey = [&](const gather::Evaluation& now) {
    return gather::BrightnessSurvey(s.rays.context(), now, s.rays.lit_cells(now), s.options.seed,
                                    s.workers, progress);
  };
  // The cells counted the direct light of beams and suns, so that these could be found; remove it,
  // since gather rays compute it by shadow rays from now on.
  const auto choose = [&](const auto& chosen) {
    const Landings before(s);
    chosen();
    const Landings after(s);
    // Direct light ends at later bounces, too, where it passes surfaces straight.
    const size_t bounces =
        s.scene.transmits() ? std::max<size_t>(1, s.paths.store.bounces().size()) : 1;
    for (uint32_t b = 0; b < bounces; ++b) {
      std::vector<uint32_t> slots(s.paths.store.bounce(b).size());
      std::iota(slots.begin(), slots.end(), 0u);
      before.add(b, slots, -1);
      after.add(b, slots, +1);
    }
    s.rays.place();
    return s.rays.evaluation(false);
  };
  gather::Evaluation now = s.rays.evaluation(false);
  gather::BrightnessSurvey found = survey(now);
  auto beams = gather::find_beams(s.rays.context(), now, found, s.options.seed);
  std::vector<gather::Guide> with_beams;  // guides, as if there were no beams
  if (!beams.empty()) {
    with_beams = gather::find_guides(s.rays.context(), now, found, progress);
    now = choose([&] { s.rays.guiding.beams = std::move(beams); });
    found = survey(now);
  }
  // The hits still include what suns light.
  std::vector<uint32_t> suns = find_suns(s, found.hits);
  if (!suns.empty()) now = choose([&] { s.rays.guiding.suns = std::move(suns); });
  std::vector<gather::Guide>& guides = s.rays.guiding.guides;
  guides = gather::find_guides(s.rays.context(), now, found, progress);
  const auto append = [&](std::span<const gather::Guide> more) {
    guides.resize(std::min(guides.size(), gather::kMaxGuides - more.size()));
    guides.insert(guides.end(), more.begin(), more.end());
  };
  append(gather::find_beside_pools(with_beams, s.rays.beams, guides));
  append(gather::find_portals(s.rays.context(), now, guides, s.options.seed, s.workers, progress));
  return now;
}

}  // namespace deltalux::session
