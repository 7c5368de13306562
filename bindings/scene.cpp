// SPDX-License-Identifier: Apache-2.0
// Bindings of scenes, which are filled from arrays, object by object.
#include "scene/scene.h"

#include <nanobind/stl/shared_ptr.h>

#include <cstring>

#include "base/error.h"
#include "common.h"
#include "lights/kinds.h"
#include "surfaces/kinds.h"
#include "surfaces/pane.h"
#include "surfaces/textured.h"
#include "trace/lights.h"

namespace deltalux::python {

using scene::Scene;
using surfaces::Texture;
using Texels =
    nb::ndarray<const uint8_t, nb::numpy, nb::shape<-1, -1, 4>, nb::c_contig, nb::device::cpu>;

std::shared_ptr<Texture> make_texture(const Texels& given) {
  const size_t height = given.shape(0), width = given.shape(1);
  if (!width || !height) throw SceneError("texture: found no texels, expected some");
  std::vector<Texture::Texel> texels(width * height);
  std::memcpy(texels.data(), given.data(), texels.size() * sizeof(Texture::Texel));
  return std::make_shared<Texture>(uint32_t(width), uint32_t(height), texels);
}

surfaces::Wrap wrap_named(const std::string& name) {
  if (name == "clamp") return surfaces::Wrap::clamp;
  return name == "mirror" ? surfaces::Wrap::mirror : surfaces::Wrap::repeat;
}

surfaces::TextureMap map_of(std::shared_ptr<const Texture> texture,
                            const std::array<std::string, 2>& wrap, bool nearest,
                            const std::array<std::array<float, 3>, 2>& matrix) {
  surfaces::TextureMap map{std::move(texture), matrix, {}, {}, false};
  map.sampler = {{wrap_named(wrap[0]), wrap_named(wrap[1])}, nearest};
  return map;
}

/// Gives the last material the radiance of a texture's texels; `full`: that of a texel of 1.
void set_glow(Scene& scene, std::shared_ptr<const Texture> texture,
              const std::array<std::string, 2>& wrap, bool nearest,
              const std::array<std::array<float, 3>, 2>& matrix, std::array<float, 3> full) {
  surfaces::TextureMap map = map_of(std::move(texture), wrap, nearest, matrix);
  map.gain = {full[0], full[1], full[2]};
  scene.materials.back().glow = std::make_shared<const surfaces::TextureMap>(std::move(map));
}

/// Gives the last material a texture: its mapping, and the mean that the reflectance stands for.
void set_texture(Scene& scene, std::shared_ptr<const Texture> texture,
                 const std::array<std::string, 2>& wrap, bool nearest,
                 const std::array<std::array<float, 3>, 2>& matrix, std::array<float, 3> mean,
                 bool cut_out) {
  surfaces::TextureMap map = map_of(std::move(texture), wrap, nearest, matrix);
  map.cut_out = cut_out;
  // Of a darker mean, rounding leaves little, and products of gains could overflow.
  constexpr float kLeastMean = 1e-3f;
  for (size_t c = 0; c < 3; ++c) map.gain[int(c)] = mean[c] >= kLeastMean ? 1 / mean[c] : 0.0f;
  scene.materials.back() = surfaces::textured(scene.materials.back(), std::move(map));
}

/// (k, 2): shares of light that pass panes straight, and that are for the diffuse lobe, by the
/// cosine between light and normal and a factor on the coverage.
nb::object pane_shares(const std::array<float, 6>& p, const Column<double>& cosine,
                       const Column<double>& opacity) {
  if (cosine.shape(0) != opacity.shape(0)) throw SceneError("pane: found arrays of unlike lengths");
  std::vector<float> out;
  for (size_t i = 0; i < cosine.shape(0); ++i) {
    const surfaces::PaneParameters pane{
        p[0] * float(opacity.data()[i]), p[1], p[2], p[3], p[4], p[5]};
    const surfaces::PaneShares own = surfaces::shares_of(pane, cosine.data()[i]);
    out.insert(out.end(), {own.straight, own.diffuse});
  }
  return make_array(std::move(out), {cosine.shape(0), 2});
}

scene::Object make_object(const std::string& name, const Rows<float, 3>& vertices,
                          const Rows<uint32_t, 3>& triangles, const Column<uint32_t>& material,
                          const Column<uint32_t>& group, bool movable, const Matrix& pose,
                          const Rows<float, 6>& texture) {
  scene::Object object;
  object.name = name;
  object.vertices = to_vectors(vertices);
  object.triangles.resize(triangles.shape(0));
  for (size_t i = 0; i < object.triangles.size(); ++i)
    for (int k = 0; k < 3; ++k) object.triangles[i][k] = triangles.data()[3 * i + k];
  object.material = to_vector(material);
  object.group = to_vector(group);
  object.movable = movable;
  object.pose = to_pose(pose);
  object.texture.resize(texture.shape(0));
  for (size_t t = 0; t < object.texture.size(); ++t)
    for (size_t k = 0; k < 6; ++k) object.texture[t][k / 2][k % 2] = texture.data()[6 * t + k];
  return object;
}

void bind_scene(nb::module_& m) {
  nb::class_<scene::Object>(m, "Object")
      .def("__init__", [](scene::Object* self, const std::string& name,
                          const Rows<float, 3>& vertices, const Rows<uint32_t, 3>& triangles,
                          const Column<uint32_t>& material, const Column<uint32_t>& group,
                          bool movable, const Matrix& pose, const Rows<float, 6>& texture) {
        new (self) scene::Object(
            make_object(name, vertices, triangles, material, group, movable, pose, texture));
      });
  m.def("pane_shares", &pane_shares);
  nb::class_<Texture>(m, "Texture", nb::is_weak_referenceable()).def(nb::new_(&make_texture));
  nb::class_<Scene>(m, "Scene")
      .def(nb::init<>())
      .def("add_material",
           [](Scene& s, const std::string& name, std::array<float, 3> reflectance,
              std::array<float, 3> emission, bool two_sided, const std::string& kind,
              std::vector<float> parameters) {
             s.materials.push_back({{reflectance[0], reflectance[1], reflectance[2]},
                                    {emission[0], emission[1], emission[2]},
                                    two_sided,
                                    &surfaces::kind_named(kind),
                                    std::move(parameters),
                                    name});
           })
      .def("set_texture", &set_texture)
      .def("set_glow", &set_glow)
      .def("add_object", [](Scene& s, const scene::Object& object) { s.objects.push_back(object); })
      .def("add_light",
           [](Scene& s, const std::string& name, const std::string& kind,
              std::array<double, 3> position, std::array<double, 3> direction,
              std::array<float, 3> intensity, std::vector<float> parameters, int64_t attached,
              uint32_t group) {
             scene::PunctualLight light;
             light.name = name;
             light.kind = &lights::kind_named(kind);
             light.position = {position[0], position[1], position[2]};
             light.direction = {direction[0], direction[1], direction[2]};
             light.intensity = {intensity[0], intensity[1], intensity[2]};
             light.parameters = std::move(parameters);
             light.attached = attached < 0 ? scene::kNone : uint32_t(attached);
             light.group = group;
             s.lights.push_back(light);
           })
      // By object and triangle: the area that emits, where several in one place emit once.
      .def("emitting_areas",
           [](Scene s) {
             s.finish();
             std::vector<std::vector<double>> areas;
             for (const scene::Object& object : s.objects)
               areas.emplace_back(object.triangles.size());
             for (const trace::Light& light : trace::find_lights(s))
               for (const trace::LightPart& part : light.parts)
                 areas[light.object][part.triangle] += part.area();
             return areas;
           })
      .def("set_groups", [](Scene& s, uint32_t count) { s.group_count = count; });
}

}  // namespace deltalux::python
