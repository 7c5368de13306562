// SPDX-License-Identifier: Apache-2.0
// Bindings of direct light: what arrives straight from lights at arbitrary points.
#include "common.h"
#include "direct/light_by_need.h"
#include "direct/receivers.h"
#include "samples/placement.h"

namespace deltalux::python {
namespace {

// metres: how far above a surface a point may lie that belongs to it
constexpr float kUnder = 1e-3f;
constexpr size_t kTogether = size_t(1) << 16;  // points per report of progress

/// Computes direct light at points of a scene; prepared once for many calls.
class DirectAt {
 public:
  DirectAt(scene::Scene scene, uint64_t seed, int threads, nb::object callback)
      : scene_(std::move(scene)), seed_(seed), workers_(threads) {
    run(callback, [&](Progress& progress) {
      scene_.finish();
      caster_ = std::make_unique<trace::RayCaster>(scene_, progress);
      lights_ = trace::find_lights(scene_);
    });
  }

  nb::object at(const Rows<float, 3>& points, const Rows<float, 3>& normals, nb::object callback) {
    const std::vector<Vec3f> p = to_vectors(points), n = to_vectors(normals);
    if (p.size() != n.size()) throw nb::value_error("points and normals differ in length");
    std::vector<double> out(3 * p.size());
    run(callback, [&](Progress& progress) {
      const float within = kUnder * samples::scene_metre(scene_, *caster_);
      const std::vector<uint8_t> all(lights_.size(), 1);
      const std::vector<double> undimmed(lights_.size(), 1.0);
      progress.begin("direct light", p.size());
      for (size_t first = 0; first < p.size(); first += kTogether) {
        const size_t count = std::min(kTogether, p.size() - first);
        const std::vector<direct::Receiver> receivers =
            direct::receivers_at(scene_, *caster_, std::span(p).subspan(first, count),
                                 std::span(n).subspan(first, count), within, workers_);
        std::vector<Vec3d> light(count);
        direct::light_by_need({*caster_, lights_, all, receivers}, undimmed, seed_, workers_,
                              progress, light);
        for (size_t i = 0; i < count; ++i)
          for (int c = 0; c < 3; ++c) out[3 * (first + i) + size_t(c)] = light[i][c];
        progress.advance(count);
      }
    });
    return make_array(std::move(out), {p.size(), 3});
  }

 private:
  scene::Scene scene_;
  uint64_t seed_;
  Workers workers_;
  std::unique_ptr<trace::RayCaster> caster_;
  std::vector<trace::Light> lights_;
};

}  // namespace

void bind_direct(nb::module_& m) {
  nb::class_<DirectAt>(m, "DirectAt")
      .def(nb::init<scene::Scene, uint64_t, int, nb::object>(), nb::arg("scene"), nb::arg("seed"),
           nb::arg("threads"), nb::arg("progress").none())
      .def("at", &DirectAt::at, nb::arg("points"), nb::arg("normals"), nb::arg("progress").none());
}

}  // namespace deltalux::python
