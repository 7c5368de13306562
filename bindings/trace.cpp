// SPDX-License-Identifier: Apache-2.0
// Bindings of ray queries on plain arrays, for images, and of light paths as arrays.
#include "base/direction.h"
#include "base/parallel.h"
#include "common.h"
#include "plan/allotment.h"
#include "samples/covered_places.h"
#include "scene/scene.h"
#include "trace/flight_columns.h"
#include "trace/ray_caster.h"

namespace deltalux::python {
namespace {

constexpr size_t kGrain = 1024;

/// A ray caster over one triangle mesh, for images and placement of samples.
class MeshCaster {
 public:
  MeshCaster(const Rows<float, 3>& vertices, const Rows<uint32_t, 3>& triangles, int threads)
      : vertices_(to_vectors(vertices)), triangles_(triangles.shape(0)), workers_(threads) {
    for (const Vec3f& v : vertices_)
      if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
        throw nb::value_error("a vertex that is not finite");
    for (size_t i = 0; i < triangles_.size(); ++i)
      for (size_t k = 0; k < 3; ++k) {
        triangles_[i][k] = triangles.data()[3 * i + k];
        if (triangles_[i][k] >= vertices_.size())
          throw nb::value_error("a triangle's corner beyond the vertices");
      }
    nb::gil_scoped_release release;
    scene_ = trace::EmbreeScene(device_, vertices_, triangles_, nullptr);
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
          const Vec3f origin{o[0], o[1], o[2]}, direction{d[0], d[1], d[2]};
          const trace::Hit hit =
              scene_.closest(0, origin, direction, 0, std::numeric_limits<float>::infinity());
          t[i] = hit.t;
          primitive[i] = hit.primitive;
          if (hit.valid()) barycentric(hit.primitive, origin + direction * hit.t, u[i], v[i]);
        }
      });
    }
    return nb::make_tuple(make_array(std::move(t), {n}), make_array(std::move(primitive), {n}),
                          make_array(std::move(u), {n}), make_array(std::move(v), {n}));
  }

  /// `behind`: a mesh with reversed winding, see samples::Layers.
  nb::object covered(const Rows<float, 3>& origins, const Rows<float, 3>& normals, float contact,
                     const MeshCaster* behind) const {
    const size_t n = origins.shape(0);
    if (normals.shape(0) != n) throw nb::value_error("origins and normals differ in length");
    std::vector<uint8_t> covered;
    {
      nb::gil_scoped_release release;
      std::vector<const trace::EmbreeScene*> layers{&scene_};
      if (behind) layers.push_back(&behind->scene_);
      covered = samples::covered_places(layers, to_vectors(origins), to_vectors(normals), contact,
                                        workers_);
    }
    return make_array(std::move(covered), {n});
  }

 private:
  void barycentric(uint32_t primitive, Vec3f p, float& u, float& v) const {
    const auto& t = triangles_[primitive];
    const Vec3d a = Vec3d(vertices_[t[0]]), e = Vec3d(vertices_[t[1]]) - a,
                f = Vec3d(vertices_[t[2]]) - a, q = Vec3d(p) - a, n = cross(e, f);
    const double area = dot(n, n);
    u = float(std::clamp(dot(cross(q, f), n) / area, 0.0, 1.0));
    v = float(std::clamp(dot(cross(e, q), n) / area, 0.0, 1.0 - double(u)));
  }

  std::vector<Vec3f> vertices_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  Workers workers_;
  trace::EmbreeDevice device_;
  trace::EmbreeScene scene_;
};

/// Traces all paths of a scene; returns their segments as columns.
nb::dict trace_paths(scene::Scene scene, uint64_t paths, uint64_t seed, uint32_t max_bounces,
                     uint32_t batches, bool second_hit, int threads, nb::object callback) {
  trace::FlightColumns flights;
  double quantum = 0;
  run(callback, [&](Progress& progress) {
    scene.finish();
    const trace::RayCaster caster(scene, progress);
    std::vector<trace::Light> lights = trace::find_lights(scene);
    const Workers workers(threads);
    std::vector<Vec3f> reflectance;
    for (const scene::Material& material : scene.materials)
      reflectance.push_back(material.reflectance);
    trace::allot_paths(lights,
                       plan::shares_by_use(scene, reflectance, caster, lights, workers, progress),
                       paths, batches);
    const trace::EnergyScale scale = trace::choose_scale(lights, max_bounces);
    quantum = scale.quantum;
    const trace::Walk walk(
        scene, caster,
        {seed, batches, max_bounces, second_hit, std::numeric_limits<float>::infinity()});
    flights = trace::trace_flights(walk, lights, scale, workers, progress);
  });
  const size_t n = flights.size();
  nb::dict out;
  out["quantum"] = quantum;
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
  nb::class_<MeshCaster>(m, "RayCaster")
      .def(nb::init<const Rows<float, 3>&, const Rows<uint32_t, 3>&, int>(), nb::arg("vertices"),
           nb::arg("triangles"), nb::arg("threads") = 0)
      .def("intersect", &MeshCaster::intersect, nb::arg("origins"), nb::arg("directions"))
      .def("covered", &MeshCaster::covered, nb::arg("origins"), nb::arg("normals"),
           nb::arg("contact"), nb::arg("behind").none() = nb::none());
  m.def("trace_paths", &trace_paths, nb::arg("scene"), nb::arg("paths"), nb::arg("seed"),
        nb::arg("max_bounces"), nb::arg("batches"), nb::arg("second_hit"), nb::arg("threads"),
        nb::arg("progress").none());
}

}  // namespace deltalux::python
