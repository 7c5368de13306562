// SPDX-License-Identifier: Apache-2.0
// Of the stage of samples: where surfaces meet.
#include "common.h"
#include "samples/contact_lines.h"

namespace deltalux::python {
namespace {

std::array<Vec3d, 3> corners_at(const Rows<double, 9>& rows, size_t row) {
  const double* v = rows.data() + 9 * row;
  return {{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]}}};
}

nb::tuple contact_lines(const Rows<double, 9>& pieces, const Column<uint32_t>& face_of,
                        const Rows<double, 9>& faces, const Rows<uint32_t, 3>& points, double gap,
                        double tolerance, int threads) {
  std::vector<samples::Piece> own(pieces.shape(0));
  std::vector<samples::Face> others(faces.shape(0));
  if (face_of.shape(0) != own.size() || points.shape(0) != others.size())
    throw nb::value_error("triangles and their numbers differ in length");
  for (size_t i = 0; i < others.size(); ++i) {
    const uint32_t* p = points.data() + 3 * i;
    others[i] = {corners_at(faces, i), {p[0], p[1], p[2]}};
  }
  for (size_t i = 0; i < own.size(); ++i) {
    if (face_of.data()[i] >= others.size()) throw nb::value_error("a number beyond the faces");
    own[i] = {corners_at(pieces, i), face_of.data()[i]};
  }
  std::vector<samples::ContactLine> lines;
  {
    nb::gil_scoped_release release;
    lines = samples::find_contact_lines(own, others, gap, tolerance, Workers(threads));
  }
  const size_t n = lines.size();
  std::vector<uint32_t> piece(n);
  std::vector<double> start(3 * n), along(3 * n), length(n);
  for (size_t i = 0; i < n; ++i) {
    piece[i] = lines[i].piece;
    length[i] = lines[i].length;
    for (int c = 0; c < 3; ++c) {
      start[3 * i + c] = lines[i].start[c];
      along[3 * i + c] = lines[i].along[c];
    }
  }
  return nb::make_tuple(make_array(std::move(piece), {n}), make_array(std::move(start), {n, 3}),
                        make_array(std::move(along), {n, 3}), make_array(std::move(length), {n}));
}

}  // namespace

void bind_samples(nb::module_& m) {
  m.def("contact_lines", &contact_lines, nb::arg("pieces"), nb::arg("face_of"), nb::arg("faces"),
        nb::arg("points"), nb::arg("gap"), nb::arg("tolerance"), nb::arg("threads") = 0);
}

}  // namespace deltalux::python
