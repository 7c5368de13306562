// SPDX-License-Identifier: Apache-2.0
// Adds the light of suns, by shadow rays, to that of a cell.
#include "gather/choose/radiosity.h"

namespace deltalux::gather {

Met meet(const Present& present, const CellFinder& finder, Vec3f origin, Vec3f w) {
  const trace::Hit hit = present.caster.closest(origin, w);
  return {hit, hit.valid() ? finder.find(hit.primitive, origin, w, hit.t) : kNoCell};
}

float radiosity_at(const Present& present, const Evaluation& evaluation, Vec3f origin, Vec3f w,
                   const trace::Hit& hit, uint32_t cell) {
  float sum = evaluation.brightness(cell);
  if (present.suns.lights().empty()) return sum;
  const direct::Receiver at = present.landing(origin, w, hit);
  const Vec3f reflectance = present.scene.material_of(hit.primitive)
                                .diffuse_at(present.scene.point_on(hit.primitive, hit.u, hit.v));
  for (const uint32_t number : present.suns.lights()) {
    const lights::Punctual& sun = present.lights[number].punctual;
    const auto share = float(sun.kind->irradiance(sun, at.point, at.normal, at.slack()));
    const Vec3f from = at.point + at.normal * at.slack();
    const auto [direction, to] = sun.kind->shadow_ray(sun, from);
    if (share > 0 && !present.caster.occluded(from, direction, to))
      sum += evaluation.dim(number) * share * dot(sun.intensity, reflectance);
  }
  return sum;
}

}  // namespace deltalux::gather
