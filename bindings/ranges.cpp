// SPDX-License-Identifier: Apache-2.0
// Bindings of sessions that share the paths of one bake, see session/session.h.
#include <cstring>
#include <optional>
#include <tuple>

#include "python_source.h"
#include "session/session.h"

namespace deltalux::python {
namespace {

using session::Session;

/// Sums in four dimensions.
using Blocks = nb::ndarray<const int64_t, nb::numpy, nb::ndim<4>, nb::c_contig, nb::device::cpu>;

std::vector<int64_t> to_numbers(const Blocks& blocks) {
  return {blocks.data(), blocks.data() + blocks.size()};
}

/// The sums of a session's paths: their number; discs (groups, batches, samples, 3); cells (cells,
/// groups of the cells' sums, batches, 3).
nb::tuple path_sums(const Session& session) {
  session::PathSums sums;
  {
    nb::gil_scoped_release release;
    sums = session.exchange().path_sums();
  }
  const size_t groups = session.state().sum_groups.size(), batches = session::kBatches;
  const size_t cell_groups = session.state().cell_groups();
  const size_t cells = sums.cells.size() / (3 * cell_groups * batches);
  const size_t samples = sums.discs.size() / (3 * groups * batches);
  return nb::make_tuple(sums.paths,
                        make_array(std::move(sums.discs), {groups, batches, samples, 3}),
                        make_array(std::move(sums.cells), {cells, cell_groups, batches, 3}));
}

/// Places and values of a row.
nb::tuple to_tuple(session::SparseRow&& row) {
  const size_t n = row.at.size();
  return nb::make_tuple(row.size, make_array(std::move(row.at), {n}),
                        make_array(std::move(row.value), {n}));
}

/// Length, places and values.
using Row = std::tuple<uint64_t, Column<uint64_t>, Column<int64_t>>;

session::SparseRow to_row(const Row& row) {
  const auto& [size, at, value] = row;
  return {size, to_vector(at), to_vector(value)};
}

/// ranges, edits, since; then length, places and values of the rows of discs, cells and openness.
nb::tuple path_changes(Session& session) {
  session::PathChanges changes;
  {
    nb::gil_scoped_release release;
    changes = session.exchange().path_changes();
  }
  nb::list ranges;
  for (const session::PathRange& range : changes.ranges)
    ranges.append(nb::make_tuple(range.first, range.last));
  return nb::make_tuple(nb::tuple(ranges), changes.edits, changes.since,
                        to_tuple(std::move(changes.discs)), to_tuple(std::move(changes.cells)),
                        to_tuple(std::move(changes.openness)));
}

constexpr size_t kSeenBytes = sizeof(gather::SeenTargets);
using Seen = Rows<uint8_t, kSeenBytes>;

/// Numbers of rays: guides seen, (n, kSeenBytes), and doublings, (n,).
nb::tuple to_tuple(session::RayNumbers&& numbers) {
  const size_t seen = numbers.seen.size(), n = numbers.doublings.size();
  std::vector<uint8_t> bytes(seen * kSeenBytes);
  if (seen) std::memcpy(bytes.data(), numbers.seen.data(), bytes.size());
  return nb::make_tuple(make_array(std::move(bytes), {seen, kSeenBytes}),
                        make_array(std::move(numbers.doublings), {n}));
}

session::RayNumbers to_ray_numbers(const Seen& seen, const Column<int8_t>& doublings) {
  session::RayNumbers numbers{std::vector<gather::SeenTargets>(seen.shape(0)),
                              to_vector(doublings)};
  if (seen.shape(0)) std::memcpy(numbers.seen.data(), seen.data(), seen.shape(0) * kSeenBytes);
  return numbers;
}

/// All arrays of what was saved, by name.
nb::dict to_arrays(const ArchiveView& archive) {
  nb::dict arrays;
  for (const std::string& name : archive.names()) {
    std::vector<uint8_t> bytes(archive.bytes(name));
    archive.read(name, 0, std::as_writable_bytes(std::span(bytes)));
    const size_t size = bytes.size();
    arrays[name.c_str()] = make_array(std::move(bytes), {size});
  }
  return arrays;
}

}  // namespace

// long: a list of names.
void bind_ranges(nb::class_<Session>& bound) {
  bound.def("path_sums", &path_sums)
      .def("segments_hash",
           [](const Session& s) {
             session::SegmentsHash hash;
             {
               nb::gil_scoped_release release;
               hash = s.segments_hash();
             }
             return make_array(std::vector<uint64_t>{hash.count, hash.a, hash.b}, {3});
           })
      .def("path_changes", &path_changes)
      .def(
          "add_path_changes",
          [](Session& s, const std::vector<std::pair<uint64_t, uint64_t>>& ranges, uint64_t edits,
             std::optional<uint64_t> since, const Row& discs, const Row& cells,
             const Row& openness) {
            session::PathChanges changes{
                {}, edits, since, to_row(discs), to_row(cells), to_row(openness)};
            for (const auto& [first, last] : ranges) changes.ranges.push_back({first, last});
            nb::gil_scoped_release release;
            s.exchange().add_path_changes(changes);
          },
          nb::arg("ranges"), nb::arg("edits"), nb::arg("since").none(), nb::arg("discs"),
          nb::arg("cells"), nb::arg("openness"))
      .def(
          "gradient_sums",
          [](Session& s, nb::object callback) {
            session::SlopeSums sums;
            run(callback, [&](Progress& p) { sums = s.slope_sums(p); });
            const size_t groups = s.state().sum_groups.size(), n = s.state().samples.size();
            return nb::make_tuple(
                make_array(std::move(sums.discs), {groups, session::kBatches, n, 3}),
                make_array(std::move(sums.moments), {groups, session::kBatches, n, 6}));
          },
          nb::arg("progress").none())
      .def(
          "gradient_with",
          [](Session& s, const Blocks& discs, const Blocks& moments, nb::object callback) {
            const session::SlopeSums others{to_numbers(discs), to_numbers(moments)};
            const size_t n = s.state().samples.size();
            std::vector<double> gradient(9 * n);
            run(callback, [&](Progress& p) { s.read_gradient(gradient.data(), p, others); });
            return make_array(std::move(gradient), {n, 3, 3});
          },
          nb::arg("discs"), nb::arg("moments"), nb::arg("progress").none())
      .def(
          "gather",
          [](Session& s, nb::object callback) {
            run(callback, [&](Progress& p) { s.exchange().gather(p); });
          },
          nb::arg("progress").none());
}

// long: a list of names.
void bind_shared_rays(nb::class_<Session>& bound) {
  bound
      .def(
          "begin_gather",
          [](Session& s, nb::object callback) {
            run(callback, [&](Progress& p) { s.exchange().begin_gather(p); });
          },
          nb::arg("progress").none())
      .def("forget_bake", &Session::forget_bake)
      .def("awaits_direct", [](const Session& s) { return s.exchange().awaits_direct(); })
      .def(
          "place_samples", [](Session& s) { s.exchange().place_samples(); },
          nb::call_guard<nb::gil_scoped_release>())
      .def(
          "cast_direct",
          [](const Session& s, size_t first, size_t last, nb::object callback) {
            std::optional<direct::DirectLight> light;
            run(callback, [&](Progress& p) { light = s.exchange().cast_direct(first, last, p); });
            ArchiveView archive;
            light->save(archive);
            return to_arrays(archive);
          },
          nb::arg("first"), nb::arg("last"), nb::arg("progress").none())
      .def(
          "take_direct",
          [](Session& s, size_t first, size_t last, nb::object source) {
            PythonSource archive(std::move(source));
            nb::gil_scoped_release release;
            s.exchange().take_direct(first, last, archive);
          },
          nb::arg("first"), nb::arg("last"), nb::arg("source"))
      .def("is_gathering", [](const Session& s) { return s.exchange().is_gathering(); })
      .def(
          "number_rays",
          [](Session& s, size_t first, size_t last, nb::object callback) {
            session::RayNumbers numbers;
            run(callback, [&](Progress& p) { numbers = s.exchange().number_rays(first, last, p); });
            return to_tuple(std::move(numbers));
          },
          nb::arg("first"), nb::arg("last"), nb::arg("progress").none())
      .def(
          "take_numbers",
          [](Session& s, const Seen& seen, const Column<int8_t>& doublings) {
            session::RayNumbers numbers = to_ray_numbers(seen, doublings);
            nb::gil_scoped_release release;
            s.exchange().take_numbers(std::move(numbers));
          },
          nb::arg("seen"), nb::arg("doublings"))
      .def(
          "ray_cuts",
          [](const Session& s, uint64_t rays) {
            std::vector<uint64_t> cuts = s.exchange().ray_cuts(rays);
            const size_t n = cuts.size();
            return make_array(std::move(cuts), {n});
          },
          nb::arg("rays"))
      .def(
          "save_aims",
          [](const Session& s, size_t first, size_t last) {
            return to_arrays(s.exchange().save_aims(first, last));
          },
          nb::arg("first"), nb::arg("last"))
      .def(
          "cast_gather_rays",
          [](Session& s, size_t first, size_t last, nb::object source, nb::object callback) {
            PythonSource aims(std::move(source));
            std::optional<gather::GatherHits> hits;
            run(callback,
                [&](Progress& p) { hits = s.exchange().cast_gather_rays(first, last, aims, p); });
            ArchiveView archive;
            hits->save(archive);
            return to_arrays(archive);
          },
          nb::arg("first"), nb::arg("last"), nb::arg("source"), nb::arg("progress").none())
      .def(
          "take_hits",
          [](Session& s, size_t first, size_t last, nb::object source) {
            PythonSource archive(std::move(source));
            nb::gil_scoped_release release;
            s.exchange().take_hits(first, last, archive);
          },
          nb::arg("first"), nb::arg("last"), nb::arg("source"));
}

}  // namespace deltalux::python
