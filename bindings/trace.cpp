// SPDX-License-Identifier: Apache-2.0
// Bindings of ray queries on plain arrays, for images, and of light paths as arrays.
#include "base/parallel.h"
#include "common.h"
#include "plan/scene_flights.h"
#include "samples/covered_places.h"
#include "scene/scene.h"
#include "trace/mesh_caster.h"

namespace deltalux::python {
namespace {

constexpr size_t kGrain = 1024;

using Triangles = std::vector<std::array<uint32_t, 3>>;

Triangles to_triangles(const Rows<uint32_t, 3>& rows, size_t vertices) {
  Triangles triangles(rows.shape(0));
  for (size_t i = 0; i < triangles.size(); ++i)
    for (size_t k = 0; k < 3; ++k) {
      triangles[i][k] = rows.data()[3 * i + k];
      if (triangles[i][k] >= vertices)
        throw nb::value_error("a triangle's corner beyond the vertices");
    }
  return triangles;
}

/// A caster over one triangle mesh, many rays at once.
class ArrayCaster {
 public:
  ArrayCaster(const Rows<float, 3>& vertices, const Rows<uint32_t, 3>& triangles, int threads)
      : workers_(threads) {
    std::vector<Vec3f> own = to_vectors(vertices);
    for (const Vec3f& v : own)
      if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
        throw nb::value_error("a vertex that is not finite");
    Triangles corners = to_triangles(triangles, own.size());
    nb::gil_scoped_release release;
    mesh_ = std::make_unique<trace::MeshCaster>(std::move(own), std::move(corners));
  }

  nb::object intersect(const Rows<float, 3>& origins, const Rows<float, 3>& directions) const {
    const size_t n = origins.shape(0);
    if (directions.shape(0) != n) throw nb::value_error("origins and directions differ in length");
    std::vector<float> t(n), u(n), v(n);
    std::vector<uint32_t> primitive(n);
    {
      nb::gil_scoped_release release;
      workers_.for_blocks(n, kGrain, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
          const float *o = origins.data() + 3 * i, *d = directions.data() + 3 * i;
          const trace::MeshHit hit = mesh_->closest({o[0], o[1], o[2]}, {d[0], d[1], d[2]});
          t[i] = hit.t, u[i] = hit.u, v[i] = hit.v;
          primitive[i] = hit.triangle;
        }
      });
    }
    return nb::make_tuple(make_array(std::move(t), {n}), make_array(std::move(primitive), {n}),
                          make_array(std::move(u), {n}), make_array(std::move(v), {n}));
  }

  /// `behind`: a mesh with reversed winding, see samples::Layers.
  nb::object covered(const Rows<float, 3>& origins, const Rows<float, 3>& normals, float contact,
                     const ArrayCaster* behind) const {
    const size_t n = origins.shape(0);
    if (normals.shape(0) != n) throw nb::value_error("origins and normals differ in length");
    std::vector<uint8_t> covered;
    {
      nb::gil_scoped_release release;
      std::vector<const trace::EmbreeScene*> layers{&mesh_->scene()};
      if (behind) layers.push_back(&behind->mesh_->scene());
      covered = samples::covered_places(layers, to_vectors(origins), to_vectors(normals), contact,
                                        workers_);
    }
    return make_array(std::move(covered), {n});
  }

 private:
  Workers workers_;
  std::unique_ptr<trace::MeshCaster> mesh_;
};

/// Traces all paths of a scene; returns their segments as columns.
nb::dict trace_paths(scene::Scene scene, const Rows<float, 3>& points,
                     const Rows<float, 3>& normals, uint64_t paths, uint64_t seed,
                     uint32_t max_bounces, uint32_t batches, bool second_hit, int threads,
                     nb::object callback) {
  plan::SceneFlights found;
  samples::SampleSet samples;
  for (size_t i = 0; i < points.shape(0); ++i) {
    samples.point.push_back({points(i, 0), points(i, 1), points(i, 2)});
    samples.normal.push_back(normalize(Vec3f{normals(i, 0), normals(i, 1), normals(i, 2)}));
    samples.attached.push_back(scene::kNone);
  }
  run(callback, [&](Progress& progress) {
    scene.finish();
    found = plan::trace_scene(
        scene, samples, paths,
        {seed, batches, max_bounces, second_hit, std::numeric_limits<float>::infinity()},
        Workers(threads), progress);
  });
  trace::FlightColumns& flights = found.columns;
  const size_t n = flights.size();
  nb::dict out;
  out["quantum"] = found.quantum;
  out["origin"] = make_array(std::move(flights.origin), {n, 3});
  out["direction"] = make_array(std::move(flights.direction), {n, 3});
  out["length"] = make_array(std::move(flights.length), {n});
  out["extended"] = make_array(std::move(flights.extended), {n});
  out["power"] = make_array(std::move(flights.power), {n, 3});
  out["path"] = make_array(std::move(flights.path), {n});
  out["primitive"] = make_array(std::move(flights.primitive), {n});
  out["bounce"] = make_array(std::move(flights.bounce), {n});
  out["group"] = make_array(std::move(flights.group), {n});
  return out;
}

}  // namespace

void bind_trace(nb::module_& m) {
  nb::class_<ArrayCaster>(m, "RayCaster")
      .def(nb::init<const Rows<float, 3>&, const Rows<uint32_t, 3>&, int>(), nb::arg("vertices"),
           nb::arg("triangles"), nb::arg("threads") = 0)
      .def("intersect", &ArrayCaster::intersect, nb::arg("origins"), nb::arg("directions"))
      .def("covered", &ArrayCaster::covered, nb::arg("origins"), nb::arg("normals"),
           nb::arg("contact"), nb::arg("behind").none() = nb::none());
  m.def("trace_paths", &trace_paths, nb::arg("scene"), nb::arg("points"), nb::arg("normals"),
        nb::arg("paths"), nb::arg("seed"), nb::arg("max_bounces"), nb::arg("batches"),
        nb::arg("second_hit"), nb::arg("threads"), nb::arg("progress").none());
}

}  // namespace deltalux::python
