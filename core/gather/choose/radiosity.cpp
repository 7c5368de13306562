// SPDX-License-Identifier: Apache-2.0
// Adds the light of suns, by shadow rays, to that of a cell.
#include "gather/choose/radiosity.h"

namespace deltalux::gather {

Met meet(const Context& context, const CellFinder& finder, Vec3f origin, Vec3f w) {
  const trace::Hit hit = context.caster.closest(origin, w);
  return {hit, hit.valid() ? finder.find(hit.primitive, origin, w, hit.t) : kNoCell};
}

float radiosity_at(const Context& context, const Evaluation& evaluation, Vec3f origin, Vec3f w,
                   const trace::Hit& hit, uint32_t cell) {
  float sum = evaluation.brightness(cell);
  if (context.suns.lights().empty()) return sum;
  const direct::Receiver at = context.landing(origin, w, hit);
  const Vec3f reflectance = context.scene.material_of(hit.primitive)
                                .diffuse_at(context.scene.point_on(hit.primitive, hit.u, hit.v));
  for (const uint32_t number : context.suns.lights()) {
    const lights::Punctual& sun = context.lights[number].punctual;
    const auto share = float(sun.kind->irradiance(sun, at.point, at.normal, at.slack()));
    const Vec3f from = at.point + at.normal * at.slack();
    const auto [direction, to] = sun.kind->shadow_ray(sun, from);
    if (share > 0 && !context.caster.occluded(from, direction, to))
      sum += evaluation.dim(number) * share * dot(sun.intensity, reflectance);
  }
  return sum;
}

}  // namespace deltalux::gather
