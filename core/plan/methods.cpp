// SPDX-License-Identifier: Apache-2.0
// One line per method.
#include "plan/methods.h"

#include "estimate/brute_force.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate/ray_map/discs.h"
#include "estimate/sphere_cache/sphere_cache.h"

namespace deltalux::plan {

std::unique_ptr<estimate::SignedEstimator> make_estimator(Method method, samples::DiscSet discs,
                                                          segments::SegmentEnd rule,
                                                          const Workers& workers,
                                                          Progress* progress) {
  switch (method) {
    case Method::brute_force:
      return std::make_unique<estimate::BruteForce>(std::move(discs), rule);
    case Method::ray_map:
      return std::make_unique<estimate::RayMapDiscs>(std::move(discs), rule);
    case Method::sphere_cache:
      return std::make_unique<estimate::SphereCache>(std::move(discs),
                                                     estimate::SphereCacheOptions{.rule = rule});
    case Method::automatic:
    case Method::disc_index:
      break;
  }
  return std::make_unique<estimate::DiscIndex>(std::move(discs), rule, workers, progress);
}

}  // namespace deltalux::plan
