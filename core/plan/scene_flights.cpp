// SPDX-License-Identifier: Apache-2.0
// Lights share the paths, one scale holds for all of them.
#include "plan/scene_flights.h"

#include <vector>

#include "plan/allotment.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::plan {

SceneFlights trace_scene(const scene::Scene& scene, const samples::SampleSet& samples,
                         uint64_t paths, const trace::Walk::Options& options,
                         const Workers& workers, Progress& progress) {
  const trace::RayCaster caster(scene, progress);
  std::vector<trace::Light> lights = trace::find_lights(scene);
  trace::allot_paths(lights, shares_by_use(scene, caster, samples, lights, workers, progress),
                     paths, options.batches);
  const trace::EnergyScale scale = trace::choose_scale(lights, options.max_bounces);
  const trace::Walk walk(scene, caster, options);
  return {trace::trace_flights(walk, lights, scale, workers, progress), scale.quantum};
}

}  // namespace deltalux::plan
