// SPDX-License-Identifier: Apache-2.0
// Bindings of estimators on plain arrays: the same segments and samples for every method.
#include "base/parallel.h"
#include "base/random.h"
#include "estimate/brute_force.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate_inputs.h"

namespace deltalux::python {
void bind_estimate(nb::module_& m) {
  nb::class_<SegmentColumns>(m, "SegmentArrays")
      .def("__init__", [](SegmentColumns* self, const Rows<float, 3>& origin,
                          const Rows<float, 3>& direction, const Column<float>& length,
                          const Column<float>& extended, const Rows<uint32_t, 3>& power) {
        new (self) SegmentColumns(to_segments(origin, direction, length, extended, power));
      });
  nb::class_<samples::DiscSet>(m, "DiscSet")
      .def("__init__", [](samples::DiscSet* self, const Rows<float, 3>& points,
                          const Rows<float, 3>& normals, const Column<float>& radius) {
        new (self) samples::DiscSet(to_discs(points, normals, radius));
      });
  m.def(
      "disc_method",
      [](const std::string& method, const SegmentColumns& segments, const samples::DiscSet& discs,
         const std::string& rule, int threads, nb::object progress) {
        const size_t n = discs.size();
        std::vector<int64_t> sums(3 * n, 0);
        estimate::Stats stats;
        run(progress, [&](Progress& p) {
          const Workers workers(threads);
          std::unique_ptr<estimate::SignedEstimator> estimator;
          if (method == "brute_force")
            estimator = std::make_unique<estimate::BruteForce>(discs, to_rule(rule));
          else
            estimator = std::make_unique<estimate::DiscIndex>(discs, to_rule(rule), workers, &p);
          const size_t count = segments.count();
          const estimate::EnergySums target{sums.data(), n, workers.threads() > 1};
          constexpr size_t kGrain = 1024;
          std::vector<estimate::Stats> parts((count + kGrain - 1) / kGrain);
          p.begin("estimate", count);
          workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
            p.check();
            parts[begin / kGrain] = estimator->accumulate(segments.span(begin, end), +1, target);
            p.advance(end - begin);
          });
          for (const estimate::Stats& part : parts) stats += part;
        });
        nb::dict counts;
        counts["hits"] = stats.hits;
        counts["disc_tests"] = stats.disc_tests;
        counts["node_tests"] = stats.node_tests;
        return nb::make_tuple(make_array(std::move(sums), {n, 3}), counts);
      },
      nb::arg("method"), nb::arg("segments"), nb::arg("discs"), nb::arg("rule"), nb::arg("threads"),
      nb::arg("progress").none());
  m.def("uniform_lines", [](size_t count, uint64_t seed) {
    // Chords through two uniform points of the unit sphere (paper 4.2; z and phi are uniform).
    std::vector<float> points(6 * count);
    for (size_t i = 0; i < count; ++i) {
      const PathRandom random(seed, i);
      for (uint32_t end = 0; end < 2; ++end) {
        const double z = 2.0 * double(random(0, 2 * end)) - 1.0;
        const double phi = 6.283185307179586 * double(random(0, 2 * end + 1));
        const double flat = std::sqrt(std::max(0.0, 1 - z * z));
        float* p = points.data() + 6 * i + 3 * end;
        p[0] = float(flat * std::cos(phi)), p[1] = float(flat * std::sin(phi)), p[2] = float(z);
      }
    }
    return make_array(std::move(points), {count, 2, 3});
  });
}

}  // namespace deltalux::python
