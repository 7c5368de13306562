// SPDX-License-Identifier: Apache-2.0
// Branch and bound over four methods: the one with the lowest bound runs its pilot first.
#include "plan/planner.h"

#include <algorithm>

namespace deltalux::plan {
namespace {

/// Sessions remember which discs a segment hit, where the method says so; then taking it away needs
/// no search.
bool remembers_hits(Method method) {
  return method == Method::disc_index || method == Method::brute_force;
}

Counts scaled(Counts counts, double factor) {
  for (double& value : counts) value *= factor;
  return counts;
}

class PartPlanner {
 public:
  PartPlanner(Pilot& pilot, const Traffic& traffic, const Machine& machine, Progress* progress)
      : pilot_(pilot),
        traffic_(traffic),
        machine_(machine),
        progress_(progress),
        discs_(double(pilot.discs().size())) {}

  MethodPlan bound(Method method) const {
    return priced(method, pilot_.least(method, traffic_.bake), pilot_.least(method, traffic_.frame),
                  false);
  }
  MethodPlan run(Method method) {
    const Counts bake = pilot_.count(method, traffic_.sample, traffic_.bake, progress_);
    const double ratio =
        traffic_.bake.segments > 0 ? traffic_.frame.segments / traffic_.bake.segments : 0.0;
    // Without work per call, counts follow the segments alone.
    const Counts frame = remembers_hits(method) || traffic_.frame.segments == 0
                             ? scaled(bake, ratio)
                             : pilot_.count(method, traffic_.sample, traffic_.frame, progress_);
    return priced(method, bake, frame, true);
  }

 private:
  MethodPlan priced(Method method, const Counts& bake, const Counts& frame, bool piloted) const {
    const auto constants = [&](const Load& load) {
      return constants_at(machine_[size_t(method)], size_of(method, discs_, load.per_call()));
    };
    const double searches = remembers_hits(method) ? 1.0 : 1.0 + traffic_.removed;
    MethodPlan plan;
    plan.method = method;
    plan.build_seconds = discs_ * constants(traffic_.bake).build;
    plan.bake = bake, plan.frame = scaled(frame, searches);
    plan.bake_seconds = search_seconds(plan.bake, constants(traffic_.bake));
    plan.frame_seconds = search_seconds(plan.frame, constants(traffic_.frame));
    plan.bytes = method_bytes(method, discs_, traffic_.bake.per_call());
    plan.piloted = piloted;
    return plan;
  }

  Pilot& pilot_;
  const Traffic& traffic_;
  const Machine& machine_;
  Progress* progress_;
  const double discs_;
};

Method by_paper(const Traffic& traffic, Policy policy) {
  const double size = policy == Policy::paper_sphere ? traffic.size_by_sphere : traffic.size_by_box;
  return traffic.moving && size < kPaperSize ? Method::sphere_cache : Method::disc_index;
}

}  // namespace

PartPlan plan_part(Pilot& pilot, Traffic traffic, Policy policy, const Machine& machine,
                   bool thorough, Progress* progress) {
  PartPlan plan;
  plan.discs = double(pilot.discs().size());
  PartPlanner planner(pilot, traffic, machine, progress);
  const auto total = [&](const MethodPlan& m) {
    return m.seconds(traffic.frames, traffic.rebuilds);
  };
  for (const Method method : kMethods) plan.methods.push_back(planner.bound(method));
  std::ranges::stable_sort(plan.methods, {}, total);
  double least = std::numeric_limits<double>::infinity();
  for (MethodPlan& method : plan.methods) {
    // Under a paper's policy a session has no use for figures.
    if (!thorough && (policy != Policy::measured || total(method) >= least)) continue;
    method = planner.run(method.method);
    least = std::min(least, total(method));
  }
  // Bounds that were not run are above the least of those that were.
  std::ranges::stable_sort(plan.methods, {}, total);
  plan.chosen =
      policy == Policy::measured ? plan.methods.front().method : by_paper(traffic, policy);
  traffic.sample = {};
  plan.traffic = std::move(traffic);
  return plan;
}

}  // namespace deltalux::plan
