// SPDX-License-Identifier: Apache-2.0
// Bindings of gather methods and patch sums on plain arrays.
#include <nanobind/stl/optional.h>

#include "base/parallel.h"
#include "estimate/local_linear.h"
#include "estimate/patch_sum.h"
#include "estimate/photon_map/photon_map.h"
#include "estimate_inputs.h"

namespace deltalux::python {
namespace {

using estimate::LocalLinear;
using estimate::Neighbours;
using estimate::PhotonMap;
using estimate::SurfaceTree;
using Tree = std::shared_ptr<const SurfaceTree>;

std::vector<Vec3d> to_doubles(const Rows<double, 3>& rows) {
  std::vector<Vec3d> out(rows.shape(0));
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = {rows.data()[3 * i], rows.data()[3 * i + 1], rows.data()[3 * i + 2]};
  return out;
}

/// Python's handle of a tree of triangles that several estimators share.
struct SharedTree {
  Tree tree;
};

nb::tuple irradiance_and_counts(estimate::Gathered&& found) {
  const size_t n = found.irradiance.size() / 3;
  nb::dict counts;
  counts["hits"] = found.stats.hits;
  counts["disc_tests"] = found.stats.disc_tests;
  return nb::make_tuple(make_array(std::move(found.irradiance), {n, 3}), counts);
}

PhotonMap::Kernel to_photon_kernel(const std::string& name) {
  return name == "cone"           ? PhotonMap::Kernel::cone
         : name == "epanechnikov" ? PhotonMap::Kernel::epanechnikov
                                  : PhotonMap::Kernel::constant;
}

Neighbours to_neighbours(const Column<uint64_t>& start, const Column<uint32_t>& photon,
                         const Column<double>& distance2, const Column<double>& radius2) {
  return {to_vector(start), to_vector(photon), to_vector(distance2), to_vector(radius2), {}};
}

void bind_photon_map(nb::module_& m) {
  nb::class_<PhotonMap>(m, "PhotonMap")
      .def(
          "__init__",
          [](PhotonMap* self, const Rows<double, 3>& points, const Rows<double, 3>& normals,
             uint32_t k, const std::string& kernel, bool unbiased, double compression, double cone,
             const SharedTree* surfaces) {
            new (self) PhotonMap(to_doubles(points), to_doubles(normals),
                                 {k, to_photon_kernel(kernel), unbiased, compression, cone},
                                 surfaces ? surfaces->tree : nullptr);
          },
          nb::arg("points"), nb::arg("normals"), nb::arg("k"), nb::arg("kernel"),
          nb::arg("unbiased"), nb::arg("compression"), nb::arg("cone"), nb::arg("surfaces").none())
      .def(
          "estimate",
          [](const PhotonMap& self, const SegmentColumns& segments, int threads,
             nb::object progress) {
            estimate::Gathered found;
            run(progress, [&](Progress& p) {
              found = self.estimate(segments.span(0, segments.count()), Workers(threads), &p);
            });
            return irradiance_and_counts(std::move(found));
          },
          nb::arg("segments"), nb::arg("threads"), nb::arg("progress").none())
      .def(
          "neighbours",
          [](const PhotonMap& self, const SegmentColumns& segments,
             std::optional<Column<double>> reach2, int threads, nb::object progress) {
            Neighbours found;
            run(progress, [&](Progress& p) {
              found = self.neighbours(segments.span(0, segments.count()), Workers(threads), p,
                                      reach2 ? reach2->data() : nullptr);
            });
            const size_t starts = found.start.size(), n = found.photon.size();
            return nb::make_tuple(make_array(std::move(found.start), {starts}),
                                  make_array(std::move(found.photon), {n}),
                                  make_array(std::move(found.distance2), {n}),
                                  make_array(std::move(found.radius2), {starts - 1}),
                                  make_array(std::move(found.rim), {starts - 1}));
          },
          nb::arg("segments"), nb::arg("reach2").none(), nb::arg("threads"),
          nb::arg("progress").none())
      .def(
          "weigh",
          [](const PhotonMap& self, const SegmentColumns& segments, const Column<uint64_t>& start,
             const Column<uint32_t>& photon, const Column<double>& distance2,
             const Column<double>& radius2, int threads, nb::object progress) {
            const Neighbours lists = to_neighbours(start, photon, distance2, radius2);
            estimate::Gathered found;
            run(progress, [&](Progress& p) {
              found = self.weigh(segments.span(0, segments.count()), lists, Workers(threads), p);
            });
            return irradiance_and_counts(std::move(found));
          },
          nb::arg("segments"), nb::arg("start"), nb::arg("photon"), nb::arg("distance2"),
          nb::arg("radius2"), nb::arg("threads"), nb::arg("progress").none());
}

}  // namespace

void bind_gather(nb::module_& m) {
  nb::class_<SharedTree>(m, "SurfaceTree")
      .def(
          "__init__",
          [](SharedTree* self, const Rows<double, 9>& corners, const Column<uint32_t>& surface) {
            Tree tree;
            {
              nb::gil_scoped_release release;
              tree =
                  std::make_shared<SurfaceTree>(corners.data(), surface.data(), corners.shape(0));
            }
            new (self) SharedTree{std::move(tree)};
          },
          nb::arg("corners"), nb::arg("surface"));
  bind_photon_map(m);
  m.def(
      "patch_sum",
      [](const SharedTree& patches, const SegmentColumns& segments, int sign, int threads,
         nb::object progress) {
        const size_t n = patches.tree->triangles().size();
        std::vector<int64_t> sums(3 * n, 0);
        estimate::Stats stats;
        run(progress, [&](Progress& p) {
          stats = estimate::PatchSum(patches.tree)
                      .accumulate(segments.span(0, segments.count()), sign, sums.data(),
                                  Workers(threads), p);
        });
        return nb::make_tuple(make_array(std::move(sums), {n, 3}), stats.hits,
                              stats.triangle_tests);
      },
      nb::arg("patches"), nb::arg("segments"), nb::arg("sign"), nb::arg("threads"),
      nb::arg("progress").none());
  m.def(
      "local_linear",
      [](const SharedTree& surfaces, const SegmentColumns& segments, const Rows<double, 3>& points,
         const Rows<double, 3>& normals, const std::string& kernel, double bandwidth,
         double expected_hits, int threads, nb::object progress) {
        const LocalLinear method(to_doubles(points), to_doubles(normals),
                                 {kernel == "constant" ? LocalLinear::Kernel::constant
                                                       : LocalLinear::Kernel::epanechnikov,
                                  bandwidth, expected_hits},
                                 surfaces.tree);
        estimate::Gathered found;
        run(progress, [&](Progress& p) {
          found = method.estimate(segments.span(0, segments.count()), Workers(threads), &p);
        });
        return irradiance_and_counts(std::move(found));
      },
      nb::arg("surfaces"), nb::arg("segments"), nb::arg("points"), nb::arg("normals"),
      nb::arg("kernel"), nb::arg("bandwidth"), nb::arg("expected_hits"), nb::arg("threads"),
      nb::arg("progress").none());
}

}  // namespace deltalux::python
