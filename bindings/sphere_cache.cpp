// SPDX-License-Identifier: Apache-2.0
// Bindings of the sphere cache on plain arrays, with its statistics by level.
#include "estimate/sphere_cache/sphere_cache.h"

#include "base/parallel.h"
#include "estimate_inputs.h"

namespace deltalux::python {
namespace {

using estimate::Containment;

Curve to_curve(const std::string& name) {
  return name == "none" ? Curve::none : name == "lebesgue" ? Curve::lebesgue : Curve::hilbert;
}

Containment to_containment(const std::string& name) {
  return name == "literal"  ? Containment::literal
         : name == "nested" ? Containment::nested
                            : Containment::all;
}

estimate::SphereCacheOptions to_options(const std::string& rule, double ratio, uint64_t min_rays,
                                        const std::string& order, const std::string& containment,
                                        double outer_radius) {
  estimate::SphereCacheOptions options;
  options.rule = to_rule(rule);
  options.ratio = ratio;
  options.min_rays = min_rays;
  options.order = to_curve(order);
  options.containment = to_containment(containment);
  options.outer_radius = outer_radius;
  return options;
}

nb::dict to_dict(const estimate::SphereCache::Result& result) {
  nb::dict counts;
  counts["hits"] = result.stats.hits;
  counts["disc_tests"] = result.stats.disc_tests;
  counts["sphere_tests"] = result.stats.sphere_tests;
  counts["radii"] = result.levels.radius;
  counts["rebuilds"] = result.levels.rebuilds;
  counts["first_misses"] = result.levels.first_misses;
  counts["rays"] = result.levels.rays;
  counts["level_tests"] = result.levels.tests;
  return counts;
}

nb::tuple sphere_cache(const SegmentColumns& segments, const samples::DiscSet& discs,
                       const std::string& rule, double ratio, uint64_t min_rays,
                       const std::string& order, const std::string& containment,
                       double outer_radius, int threads, nb::object progress) {
  const size_t n = discs.size();
  std::vector<int64_t> sums(3 * n, 0);
  estimate::SphereCache::Result result;
  run(progress, [&](Progress& p) {
    const estimate::SphereCache cache(
        discs, to_options(rule, ratio, min_rays, order, containment, outer_radius), &p);
    result = cache.accumulate_levels(segments.span(0, segments.count()), +1,
                                     {sums.data(), n, false}, Workers(threads), &p);
  });
  return nb::make_tuple(make_array(std::move(sums), {n, 3}), to_dict(result));
}

/// Counts of the upper levels only: no disc is tested, nothing is summed.
nb::dict sphere_cache_upper(const SegmentColumns& segments, const samples::DiscSet& discs,
                            const std::string& rule, double ratio, uint64_t min_rays,
                            const std::string& order, double outer_radius, uint32_t levels,
                            int threads, nb::object progress) {
  estimate::SphereCache::Result result;
  estimate::SphereCacheOptions options =
      to_options(rule, ratio, min_rays, order, "all", outer_radius);
  options.max_levels = levels;
  options.deposits = false;
  run(progress, [&](Progress& p) {
    const estimate::SphereCache cache(discs, options, &p);
    result =
        cache.accumulate_levels(segments.span(0, segments.count()), +1, {}, Workers(threads), &p);
  });
  return to_dict(result);
}

}  // namespace

void bind_sphere_cache(nb::module_& m) {
  m.def("sphere_cache", sphere_cache, nb::arg("segments"), nb::arg("discs"), nb::arg("rule"),
        nb::arg("ratio"), nb::arg("min_rays"), nb::arg("order"), nb::arg("containment"),
        nb::arg("outer_radius"), nb::arg("threads"), nb::arg("progress").none());
  m.def("sphere_cache_upper", sphere_cache_upper, nb::arg("segments"), nb::arg("discs"),
        nb::arg("rule"), nb::arg("ratio"), nb::arg("min_rays"), nb::arg("order"),
        nb::arg("outer_radius"), nb::arg("levels"), nb::arg("threads"), nb::arg("progress").none());
  m.def(
      "enclosing_radius",
      [](const SegmentColumns& segments, const std::string& rule, float max_radius) {
        return estimate::enclosing_radius(segments.span(0, segments.count()), to_rule(rule),
                                          max_radius);
      },
      nb::arg("segments"), nb::arg("rule"), nb::arg("most_radius"));
}

}  // namespace deltalux::python
