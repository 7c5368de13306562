// SPDX-License-Identifier: Apache-2.0
// Runs the pilot of the disc index first, and those of other methods only if they may be cheaper.
#include "plan/planner.h"

#include <algorithm>

namespace deltalux::plan {
namespace {

/// A method that cannot save more than a tenth is not worth its pilot.
constexpr double kWorth = 0.9;

/// Whether the method reports which discs a segment hit. Sessions then remember them, so that
/// removal needs no search.
bool remembers_hits(Method method) {
  return method == Method::disc_index || method == Method::brute_force;
}

Counts scaled(Counts counts, double factor) {
  for (double& value : counts) value *= factor;
  return counts;
}

/// No method searches faster than an index that is built already: so it was in all 68
/// configurations of benchmarks/planner_regret.py.
MethodPlan no_faster(MethodPlan plan, const MethodPlan& index) {
  plan.bake_seconds = std::max(plan.bake_seconds, index.bake_seconds);
  plan.frame_seconds = std::max(plan.frame_seconds, index.frame_seconds);
  return plan;
}

class PartPlanner {
 public:
  PartPlanner(Pilot& pilot, const Traffic& traffic, const Machine& machine, Progress* progress)
      : pilot_(pilot),
        traffic_(traffic),
        machine_(machine),
        progress_(progress),
        discs_(double(pilot.discs().size())) {}

  /// A lower bound of the cost of `method`.
  MethodPlan bound(Method method, const MethodPlan& index) const {
    return no_faster(priced(method, pilot_.least(method, traffic_.bake),
                            pilot_.least(method, traffic_.frame), false),
                     index);
  }
  /// The counts of brute force, computed without a run; its hits are those of the index.
  MethodPlan pairs(const MethodPlan& index) const {
    const auto counts = [&](const Load& load, const Counts& found) {
      Counts all = pilot_.least(Method::brute_force, load);
      all[kHits] = found[kHits], all[kOutlineTests] = found[kOutlineTests];
      return all;
    };
    return priced(Method::brute_force, counts(traffic_.bake, index.bake),
                  counts(traffic_.frame, index.frame), true);
  }
  MethodPlan run(Method method) {
    const Counts bake = pilot_.count(method, traffic_.sample, traffic_.bake, progress_);
    const double ratio =
        traffic_.bake.segments > 0 ? traffic_.frame.segments / traffic_.bake.segments : 0.0;
    // Methods without work per call: counts are proportional to the number of segments.
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

/// Chooses the cheapest method. Predictions are not accurate enough to distinguish the searches of
/// an existing index from faster ones, and in fact no method is faster; so other methods can only
/// save the time to build the index, and are chosen only if that is a tenth of the total. If
/// estimators are rebuilt in every frame, each method counts as predicted.
Method cheapest(const std::vector<MethodPlan>& methods, const Traffic& traffic,
                const MethodPlan& index) {
  const auto total = [&](const MethodPlan& m) {
    const bool pairs = m.method == Method::brute_force, own = m.method == Method::disc_index;
    if (traffic.rebuilds || pairs || own) return m.seconds(traffic.frames, traffic.rebuilds);
    return no_faster(m, index).seconds(traffic.frames, false) / kWorth;
  };
  const MethodPlan* least = nullptr;
  for (const MethodPlan& m : methods)
    if (m.piloted && (!least || total(m) < total(*least))) least = &m;
  return least->method;
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
  const MethodPlan index = planner.run(Method::disc_index);
  const MethodPlan pairs = planner.pairs(index);
  plan.methods = {index, pairs, planner.bound(Method::ray_map, index),
                  planner.bound(Method::sphere_cache, index)};
  std::ranges::stable_sort(plan.methods, {}, total);
  double least = std::min(total(index), total(pairs));
  for (MethodPlan& method : plan.methods) {
    if (method.piloted || (!thorough && total(method) >= kWorth * least)) continue;
    method = planner.run(method.method);
    least = std::min(least, total(method));
  }
  std::ranges::stable_sort(plan.methods, {}, total);
  plan.chosen = policy == Policy::measured ? cheapest(plan.methods, traffic, index)
                                           : by_paper(traffic, policy);
  traffic.sample = {};
  plan.traffic = std::move(traffic);
  return plan;
}

}  // namespace deltalux::plan
