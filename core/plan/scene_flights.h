// SPDX-License-Identifier: Apache-2.0
// All flights of all paths of a scene, without a session: paths are allotted to lights as a bake
// does.
#pragma once
#include "base/parallel.h"
#include "base/progress.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "trace/flight_columns.h"
#include "trace/walk.h"

namespace deltalux::plan {

struct SceneFlights {
  trace::FlightColumns columns;
  double quantum = 0;  ///< of their power
};

/// `samples`: where light is wanted, see shares_by_use(). The scene is finished. Throws Cancelled,
/// OptionError.
SceneFlights trace_scene(const scene::Scene& scene, const samples::SampleSet& samples,
                         uint64_t paths, const trace::Walk::Options& options,
                         const Workers& workers, Progress& progress);

}  // namespace deltalux::plan
