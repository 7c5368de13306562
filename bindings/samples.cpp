// SPDX-License-Identifier: Apache-2.0
// Bindings of the samples stage: contact lines, and operations on display meshes.
#include "common.h"
#include "samples/components.h"
#include "samples/contact_lines.h"
#include "samples/cube_groups.h"
#include "samples/mesh_edges.h"
#include "samples/places.h"
#include "samples/sharing.h"
#include "samples/smooth_vertices.h"
#include "samples/subdivision.h"
#include "samples/triangle_shapes.h"

namespace deltalux::python {
namespace {

using samples::Triangle;
using Points = Rows<double, 3>;
using Triangles = Rows<int64_t, 3>;
using Numbers = Column<int64_t>;
using Flags = Rows<bool, 3>;

template <class T, size_t Columns>
std::span<const T> rows(const auto& array) {
  static_assert(sizeof(T) == Columns * sizeof(*array.data()));
  return {reinterpret_cast<const T*>(array.data()), array.shape(0)};
}
std::span<const Vec3d> spanned(const Points& points) { return rows<Vec3d, 3>(points); }
std::span<const Triangle> spanned(const Triangles& triangles) {
  return rows<Triangle, 3>(triangles);
}
template <class T>
std::span<const T> spanned(const Column<T>& column) {
  return {column.data(), column.shape(0)};
}
std::span<const uint8_t> flags_of(const Flags& flags) {
  return {reinterpret_cast<const uint8_t*>(flags.data()), 3 * flags.shape(0)};
}

/// Throws unless all numbers are in [0, limit): indices from outside are checked before use.
template <class T>
void check_below(const T* numbers, size_t count, size_t limit) {
  for (size_t i = 0; i < count; ++i)
    if (numbers[i] < 0 || size_t(numbers[i]) >= limit)
      throw nb::value_error("a number beyond those that there are");
}
void check_below(const Triangles& triangles, size_t points) {
  check_below(triangles.data(), triangles.size(), points);
}
void check_equal(size_t one, size_t two) {
  if (one != two) throw nb::value_error("arrays differ in length");
}

template <class T>
nb::object array(std::vector<T>&& values) {
  const size_t n = values.size();
  return make_array(std::move(values), {n});
}

/// An array with rows of numbers of type T; the array owns the memory.
template <class T, class Row>
nb::object table(std::vector<Row>&& values, std::initializer_list<size_t> shape) {
  auto* owner = new std::vector<Row>(std::move(values));
  nb::capsule capsule(owner, [](void* p) noexcept { delete static_cast<std::vector<Row>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(owner->data(), shape.size(), shape.begin(), capsule));
}
nb::object array(std::vector<Vec3d>&& values) {
  const size_t n = values.size();
  return table<double>(std::move(values), {n, 3});
}
nb::object array(std::vector<Triangle>&& values) {
  const size_t n = values.size();
  return table<int64_t>(std::move(values), {n, 3});
}
template <class Work>
auto released(const Work& work) {
  nb::gil_scoped_release release;
  return work();
}

nb::tuple contact_lines(const Points& points, const Triangles& pieces, const Numbers& face_of,
                        const Triangles& faces, const Triangles& places, double gap,
                        double tolerance, int threads) {
  check_equal(face_of.shape(0), pieces.shape(0));
  check_equal(places.shape(0), faces.shape(0));
  check_below(pieces, points.shape(0));
  check_below(faces, points.shape(0));
  check_below(face_of.data(), face_of.shape(0), faces.shape(0));
  const std::vector<samples::ContactLine> lines = released([&] {
    return samples::find_contact_lines(spanned(points), {spanned(pieces), spanned(face_of)},
                                       {spanned(faces), spanned(places)}, gap, tolerance,
                                       Workers(threads));
  });
  const size_t n = lines.size();
  std::vector<int64_t> piece(n);
  std::vector<Vec3d> start(n), along(n);
  std::vector<double> length(n);
  for (size_t i = 0; i < n; ++i) {
    piece[i] = lines[i].piece;
    length[i] = lines[i].length;
    start[i] = lines[i].start;
    along[i] = lines[i].along;
  }
  return nb::make_tuple(array(std::move(piece)), array(std::move(start)), array(std::move(along)),
                        make_array(std::move(length), {n}));
}

nb::object connected_components(const Numbers& one, const Numbers& two, size_t count) {
  check_equal(one.shape(0), two.shape(0));
  for (const Numbers* ends : {&one, &two}) check_below(ends->data(), ends->shape(0), count);
  return array(
      released([&] { return samples::connected_components(spanned(one), spanned(two), count); }));
}

nb::tuple shared_edges(const Triangles& triangles, size_t points) {
  check_below(triangles, points);
  auto [one, two] = released([&] { return samples::shared_edges(spanned(triangles), points); });
  return nb::make_tuple(array(std::move(one)), array(std::move(two)));
}

nb::object junctions(const Points& points, const Triangles& triangles, double shortest) {
  check_below(triangles, points.shape(0));
  return table<bool>(
      released([&] { return samples::junctions(spanned(points), spanned(triangles), shortest); }),
      {triangles.shape(0), 3});
}

nb::object repeated_triangles(const Triangles& triangles, size_t points) {
  check_below(triangles, points);
  return table<bool>(
      released([&] { return samples::repeated_triangles(spanned(triangles), points); }),
      {triangles.shape(0)});
}

nb::object same_places(const Points& points, double rounding) {
  return array(released([&] { return samples::same_places(spanned(points), rounding); }));
}

nb::tuple welded_points(const Points& points, const Numbers& first, double rounding) {
  if (first.shape(0) == 0 || first.data()[0] != 0 ||
      first.data()[first.shape(0) - 1] != int64_t(points.shape(0)) ||
      !std::is_sorted(first.data(), first.data() + first.shape(0)))
    throw nb::value_error("bodies do not have all points");
  auto [representative, position] =
      released([&] { return samples::welded_points(spanned(points), spanned(first), rounding); });
  return nb::make_tuple(array(std::move(representative)), array(std::move(position)));
}

nb::object split_long_edges(const Points& points, const Triangles& triangles, double squared_limit,
                            size_t most) {
  check_below(triangles, points.shape(0));
  auto split = released([&] {
    return samples::split_long_edges(spanned(points), spanned(triangles), squared_limit, most);
  });
  if (!split) return nb::none();
  return nb::make_tuple(array(std::move(split->added)), array(std::move(split->pieces.triangles)),
                        array(std::move(split->pieces.source)));
}

std::optional<size_t> count_halved_edges(const Points& points, const Triangles& triangles,
                                         double squared_limit, size_t most) {
  check_below(triangles, points.shape(0));
  return released([&] {
    return samples::count_halved_edges(spanned(points), spanned(triangles), squared_limit, most);
  });
}

nb::tuple split_marked(const Points& points, const Triangles& triangles, const Numbers& source,
                       const Flags& marked, const Triangles& middle) {
  check_below(triangles, points.shape(0));
  for (const size_t n : {source.shape(0), marked.shape(0), middle.shape(0)})
    check_equal(n, triangles.shape(0));
  for (size_t i = 0; i < marked.size(); ++i)
    if (marked.data()[i]) check_below(middle.data() + i, 1, points.shape(0));
  samples::Pieces pieces = released([&] {
    return samples::split_marked(spanned(points), spanned(triangles), spanned(source),
                                 rows<samples::Marks, 3>(marked), spanned(middle));
  });
  return nb::make_tuple(array(std::move(pieces.triangles)), array(std::move(pieces.source)));
}

nb::object smooth_vertices(const Points& points, const Triangles& triangles,
                           const Column<double>& cosine, const Flags& parted, const Flags& beside,
                           double farthest, double share, size_t most) {
  check_below(triangles, points.shape(0));
  for (const size_t n : {cosine.shape(0), parted.shape(0), beside.shape(0)})
    check_equal(n, triangles.shape(0));
  auto found = released([&] {
    const samples::ShadedMesh mesh{spanned(points), spanned(triangles), spanned(cosine),
                                   flags_of(parted), flags_of(beside)};
    return samples::smooth_vertices(mesh, farthest, share, most);
  });
  if (!found) return nb::none();
  const size_t n = triangles.shape(0);
  return nb::make_tuple(table<int64_t>(std::move(found->of_corner), {n, 3}),
                        array(std::move(found->corner)), array(std::move(found->normal)),
                        array(std::move(found->inset)));
}

nb::object groups_in_cubes(const Points& vertices, const Triangles& triangles, const Numbers& kind,
                           double edge, double offset) {
  check_below(triangles, vertices.shape(0));
  check_equal(kind.shape(0), vertices.shape(0));
  return array(released([&] {
    return samples::groups_in_cubes(spanned(vertices), spanned(triangles), spanned(kind), edge,
                                    offset);
  }));
}

nb::object centroid_vertices(const Points& points, const Numbers& group) {
  check_equal(group.shape(0), points.shape(0));
  check_below(group.data(), group.shape(0), points.shape(0));
  return array(
      released([&] { return samples::centroid_vertices(spanned(points), spanned(group)); }));
}

nb::tuple shared_weights(const Points& points, const Points& normals, const Triangles& triangles,
                         const Numbers& kind, const Numbers& group, const Numbers& vertex,
                         const Numbers& others, const Rows<int64_t, samples::kNeighbours>& near,
                         double edge, double reach, double least_cosine, double least_bound,
                         int threads) {
  const size_t n = points.shape(0);
  check_below(triangles, n);
  for (const size_t own : {normals.shape(0), kind.shape(0), group.shape(0)}) check_equal(own, n);
  for (const Numbers* of : {&vertex, &others}) check_below(of->data(), of->shape(0), n);
  check_below(group.data(), n, vertex.shape(0));
  check_equal(near.shape(0), others.shape(0));
  check_below(near.data(), near.size(), vertex.shape(0));
  samples::SharedWeights found = released([&] {
    const samples::GroupedMesh mesh{spanned(points), spanned(normals), spanned(triangles),
                                    spanned(kind),   spanned(group),   spanned(vertex)};
    return samples::shared_weights(
        mesh, spanned(others),
        rows<std::array<int64_t, samples::kNeighbours>, samples::kNeighbours>(near),
        {edge, reach, least_cosine, least_bound}, Workers(threads));
  });
  const size_t k = others.shape(0);
  return nb::make_tuple(table<int32_t>(std::move(found.samples), {k, samples::kNeighbours}),
                        table<float>(std::move(found.weights), {k, samples::kNeighbours}));
}

nb::object normals_by_area(const Points& points, const Triangles& triangles) {
  check_below(triangles, points.shape(0));
  return array(
      released([&] { return samples::normals_by_area(spanned(points), spanned(triangles)); }));
}

nb::object areas(const Points& points, const Triangles& triangles) {
  check_below(triangles, points.shape(0));
  return make_array(released([&] { return samples::areas(spanned(points), spanned(triangles)); }),
                    {triangles.shape(0)});
}

nb::object without_area(const Points& points, const Triangles& triangles) {
  check_below(triangles, points.shape(0));
  return table<bool>(
      released([&] { return samples::without_area(spanned(points), spanned(triangles)); }),
      {triangles.shape(0)});
}

nb::object wide_triangles(const Points& points, const Triangles& triangles, double longest,
                          double narrowest) {
  check_below(triangles, points.shape(0));
  return table<bool>(released([&] {
                       return samples::wide_triangles(spanned(points), spanned(triangles), longest,
                                                      narrowest);
                     }),
                     {triangles.shape(0)});
}

}  // namespace

void bind_samples(nb::module_& m) {
  m.def("contact_lines", &contact_lines, nb::arg("points"), nb::arg("pieces"), nb::arg("face_of"),
        nb::arg("faces"), nb::arg("places"), nb::arg("gap"), nb::arg("tolerance"),
        nb::arg("threads") = 0);
  m.def("connected_components", &connected_components, nb::arg("one"), nb::arg("two"),
        nb::arg("count"));
  m.def("shared_edges", &shared_edges, nb::arg("triangles"), nb::arg("points"));
  m.def("junctions", &junctions, nb::arg("points"), nb::arg("triangles"), nb::arg("shortest"));
  m.def("repeated_triangles", &repeated_triangles, nb::arg("triangles"), nb::arg("points"));
  m.def("same_places", &same_places, nb::arg("points"), nb::arg("rounding"));
  m.def("welded_points", &welded_points, nb::arg("points"), nb::arg("first"), nb::arg("rounding"));
  m.def("split_long_edges", &split_long_edges, nb::arg("points"), nb::arg("triangles"),
        nb::arg("squared_limit"), nb::arg("most"));
  m.def("count_halved_edges", &count_halved_edges, nb::arg("points"), nb::arg("triangles"),
        nb::arg("squared_limit"), nb::arg("most"));
  m.def("split_marked", &split_marked, nb::arg("points"), nb::arg("triangles"), nb::arg("source"),
        nb::arg("marked"), nb::arg("middle"));
  m.def("smooth_vertices", &smooth_vertices, nb::arg("points"), nb::arg("triangles"),
        nb::arg("cosine"), nb::arg("parted"), nb::arg("beside"), nb::arg("farthest"),
        nb::arg("share"), nb::arg("most"));
  m.def("groups_in_cubes", &groups_in_cubes, nb::arg("vertices"), nb::arg("triangles"),
        nb::arg("kind"), nb::arg("edge"), nb::arg("offset"));
  m.def("centroid_vertices", &centroid_vertices, nb::arg("points"), nb::arg("group"));
  m.def("shared_weights", &shared_weights, nb::arg("points"), nb::arg("normals"),
        nb::arg("triangles"), nb::arg("kind"), nb::arg("group"), nb::arg("vertex"),
        nb::arg("others"), nb::arg("near"), nb::arg("edge"), nb::arg("reach"),
        nb::arg("least_cosine"), nb::arg("least_bound"), nb::arg("threads") = 0);
  m.def("normals_by_area", &normals_by_area, nb::arg("points"), nb::arg("triangles"));
  m.def("areas", &areas, nb::arg("points"), nb::arg("triangles"));
  m.def("without_area", &without_area, nb::arg("points"), nb::arg("triangles"));
  m.def("wide_triangles", &wide_triangles, nb::arg("points"), nb::arg("triangles"),
        nb::arg("longest"), nb::arg("narrowest"));
}

}  // namespace deltalux::python
