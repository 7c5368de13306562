// SPDX-License-Identifier: Apache-2.0
// Helpers of the bindings: array types, and long calls with progress and Ctrl-C.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <memory>
#include <numeric>
#include <vector>

#include "base/assertion.h"
#include "base/progress.h"
#include "base/transform.h"
#include "base/vec.h"

namespace deltalux::session {
class Session;
}

namespace deltalux::python {

namespace nb = nanobind;

template <class T, size_t Columns>
using Rows = nb::ndarray<const T, nb::numpy, nb::shape<-1, Columns>, nb::c_contig, nb::device::cpu>;
template <class T>
using Column = nb::ndarray<const T, nb::numpy, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::numpy, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;

/// A NumPy array that owns its memory.
template <class T>
nb::object make_array(std::vector<T>&& values, std::initializer_list<size_t> shape) {
  DELTALUX_ASSERT(values.size() ==
                  std::accumulate(shape.begin(), shape.end(), size_t(1), std::multiplies<>()));
  auto* owner = new std::vector<T>(std::move(values));
  nb::capsule capsule(owner, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(owner->data(), shape.size(), shape.begin(), capsule));
}

inline std::vector<Vec3f> to_vectors(const Rows<float, 3>& rows) {
  std::vector<Vec3f> out(rows.shape(0));
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = {rows.data()[3 * i], rows.data()[3 * i + 1], rows.data()[3 * i + 2]};
  return out;
}

template <class T>
std::vector<T> to_vector(const Column<T>& column) {
  return {column.data(), column.data() + column.shape(0)};
}

inline Pose to_pose(const Matrix& m) {
  Pose pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) pose.row[r][c] = m.data()[4 * r + c];
    pose.translation[r] = m.data()[4 * r + 3];
  }
  return pose;
}

/// Runs `work` in a new thread, while the calling thread reports progress every 20 ms (see
/// set_report_seconds) to `callback` (stage, fraction) -> keep going, and checks for Ctrl-C.
/// Releases the GIL.
void run(nb::object callback, const std::function<void(Progress&)>& work);

void bind_scene(nb::module_& m);
void bind_trace(nb::module_& m);
void bind_samples(nb::module_& m);
void bind_direct(nb::module_& m);
void bind_estimate(nb::module_& m);
void bind_sphere_cache(nb::module_& m);
void bind_ray_map(nb::module_& m);
void bind_gather(nb::module_& m);
void bind_plan(nb::module_& m);
void bind_session(nb::module_& m);
/// Parts of bind_session(): what paths of ranges bring; rays that others cast.
void bind_ranges(nb::class_<session::Session>& bound);
void bind_shared_rays(nb::class_<session::Session>& bound);

}  // namespace deltalux::python
