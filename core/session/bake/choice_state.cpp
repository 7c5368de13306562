// SPDX-License-Identifier: Apache-2.0
// Takes movables away, and what edits made of reflectances, lamps and dimming.
#include "session/bake/choice_state.h"

#include <algorithm>
#include <utility>

#include "session/bake/trace_all.h"

namespace deltalux::session {
namespace {

Options options_of(const State& s) {
  Options options = s.options;
  options.range.reset();
  options.paths = std::min(options.paths, kMostChoicePaths);
  return options;
}

}  // namespace

std::vector<uint32_t> fixed_samples(const World& world) {
  std::vector<uint32_t> out;
  for (uint32_t i = 0; i < world.samples.size(); ++i)
    if (world.samples.attached[i] == scene::kNone) out.push_back(i);
  return out;
}

std::unique_ptr<State> choice_state(const State& s, Progress& progress) {
  progress.begin("find what lamps light", 1);
  Progress part(&progress);
  auto out = std::make_unique<State>(options_of(s));
  State& c = *out;
  c.scene = s.as_loaded();
  const std::vector<uint32_t> fixed = fixed_samples(s);
  c.samples = s.samples.reordered(fixed);
  for (const uint32_t i : fixed) c.slack.push_back(s.slack[i]);
  c.group_factor.assign(c.scene.group_count, 1.0);
  c.light_sampled = s.light_sampled;
  c.light_sampled.resize(s.loaded_lights.size());
  for (size_t l = 0; l < s.loaded_lights.size(); ++l) c.lights.push_back(s.as_loaded(l));
  trace::allot_paths(c.lights, s.path_shares, c.options.paths, kBatches);
  c.scale = trace::choose_scale(c.lights, c.options.max_bounces);
  c.group_sums();
  c.paths.held = c.held();
  c.caster = std::make_unique<trace::RayCaster>(c.scene, part);
  c.cells.divide(part);
  PlacedDiscs no_discs;
  c.discs.plan(no_discs, {}, false, part);
  c.discs.make_estimators(no_discs, part);
  Frame frame;
  trace_all(c, part, frame);
  c.cells.cover(part);
  c.direct.scales = s.direct.scales;
  c.direct.place();
  return out;
}

}  // namespace deltalux::session
