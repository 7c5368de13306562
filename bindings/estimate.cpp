// SPDX-License-Identifier: Apache-2.0
// Estimators on plain arrays: the same segments and samples for every method.
#include "base/parallel.h"
#include "base/random.h"
#include "common.h"
#include "estimate/brute_force.h"
#include "estimate/crossing.h"
#include "estimate/disc_index.h"

namespace deltalux::python {
namespace {

using segments::SegmentEnd;

SegmentEnd to_rule(const std::string& name) {
  return name == "first"    ? SegmentEnd::first
         : name == "second" ? SegmentEnd::second
                            : SegmentEnd::bounded;
}

/// Segments as a user holds them (rows) turned into structure of arrays.
struct SegmentArrays {
  std::vector<float> column[8];
  std::vector<uint32_t> power;
  segments::SegmentSpan span(size_t begin, size_t end) const {
    const auto at = [&](int k) { return column[k].data() + begin; };
    return {end - begin, at(0), at(1), at(2), at(3),
            at(4),       at(5), at(6), at(7), power.data() + 3 * begin,
            nullptr};
  }
};

SegmentArrays to_segments(const Rows<float, 3>& origin, const Rows<float, 3>& direction,
                          const Column<float>& length, const Column<float>& extended,
                          const Rows<uint32_t, 3>& power) {
  SegmentArrays out;
  const size_t n = origin.shape(0);
  for (int k = 0; k < 3; ++k) {
    out.column[k].resize(n);
    out.column[k + 3].resize(n);
    for (size_t i = 0; i < n; ++i) {
      out.column[k][i] = origin.data()[3 * i + k];
      out.column[k + 3][i] = direction.data()[3 * i + k];
    }
  }
  out.column[6] = to_vector(length);
  out.column[7] = to_vector(extended);
  out.power.assign(power.data(), power.data() + 3 * n);
  return out;
}

samples::DiscSet to_discs(const Rows<float, 3>& points, const Rows<float, 3>& normals,
                          const Column<float>& radius) {
  samples::DiscSet discs;
  discs.centre = to_vectors(points);
  discs.normal = to_vectors(normals);
  for (Vec3f& n : discs.normal) n = normalize(n);
  discs.radius = to_vector(radius);
  discs.outline.assign(discs.size(), samples::kWholeDisc);
  discs.id.resize(discs.size());
  for (uint32_t i = 0; i < discs.size(); ++i) discs.id[i] = i;
  return discs;
}

}  // namespace

void bind_estimate(nb::module_& m) {
  m.def(
      "disc_method",
      [](const std::string& method, const Rows<float, 3>& origin, const Rows<float, 3>& direction,
         const Column<float>& length, const Column<float>& extended, const Rows<uint32_t, 3>& power,
         const Rows<float, 3>& points, const Rows<float, 3>& normals, const Column<float>& radius,
         const std::string& rule, int threads, nb::object progress) {
        const SegmentArrays segments = to_segments(origin, direction, length, extended, power);
        samples::DiscSet discs = to_discs(points, normals, radius);
        const size_t n = discs.size();
        std::vector<int64_t> sums(3 * n, 0);
        estimate::Stats stats;
        run(progress, [&](Progress& p) {
          const Workers workers(threads);
          std::unique_ptr<estimate::SignedEstimator> estimator;
          if (method == "brute_force")
            estimator = std::make_unique<estimate::BruteForce>(std::move(discs), to_rule(rule));
          else
            estimator =
                std::make_unique<estimate::DiscIndex>(std::move(discs), to_rule(rule), workers, &p);
          const size_t count = segments.column[0].size();
          constexpr size_t kGrain = 1024;
          std::vector<estimate::Stats> parts((count + kGrain - 1) / kGrain);
          p.begin("estimate", count);
          workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
            p.check();
            parts[begin / kGrain] =
                estimator->accumulate(segments.span(begin, end), +1, {sums.data(), n});
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
      nb::arg("method"), nb::arg("origin"), nb::arg("direction"), nb::arg("length"),
      nb::arg("extended"), nb::arg("power"), nb::arg("points"), nb::arg("normals"),
      nb::arg("radius"), nb::arg("rule"), nb::arg("threads"), nb::arg("progress").none());
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
