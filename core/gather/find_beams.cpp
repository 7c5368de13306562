// SPDX-License-Identifier: Apache-2.0
// A pilot's votes, by the spot that lights them.
#include "gather/find_beams.h"

#include <optional>

namespace deltalux::gather {
namespace {

constexpr float kLitByIt = 2;  // times what a spot gives there is more than all light

std::optional<BeamGuide> find_beam(const Present& present, const Evaluation& evaluation,
                                   const Votes& votes, uint32_t light, uint64_t seed) {
  const trace::Light& lamp = present.lights[light];
  const direct::LightShape shape(lamp, light, seed);
  const auto power = [&](uint32_t primitive) {
    const Vec3f reflectance =
        present.scene.materials[present.scene.material_index(primitive)].reflectance;
    return evaluation.dim(light) * dot(lamp.intensity, reflectance);
  };
  const auto lit_by_it = [&](const Vote& vote) {
    const direct::Receiver at{vote.at, vote.normal, scene::kNone,
                              present.scene.slack_of(vote.primitive)};
    const direct::LightShape::Glance ray = shape.glance(at, 0, 0);
    return kLitByIt * float(ray.irradiance) * power(vote.primitive) > vote.radiosity &&
           !present.caster.occluded_static(ray.origin, ray.direction, ray.to) &&
           !present.caster.occluded_movable(ray.origin, ray.direction, ray.to);
  };
  std::vector<float> around;
  size_t bright = 0;
  double weight = 0, sent = 0;
  for (const Vote& vote : votes.all) {
    if (!lit_by_it(vote)) continue;
    around.push_back(vote.around);
    if (!vote.bright()) continue;
    ++bright;
    weight += vote.weight, sent += double(power(vote.primitive));
  }
  if (!votes.suffice(bright, around.size(), weight)) return std::nullopt;
  const BeamGuide guide{light, float(sent / double(bright) * trace::spot_solid_angle(lamp)),
                        median(around)};
  return guide.flaw(present.lights) ? std::nullopt : std::optional(guide);
}

}  // namespace

std::vector<BeamGuide> find_beams(const Present& present, const Evaluation& evaluation,
                                  const Votes& votes, uint64_t seed) {
  std::vector<BeamGuide> beams;
  for (uint32_t light = 0; light < present.lights.size(); ++light) {
    const trace::Light& lamp = present.lights[light];
    if (beams.size() == kMostBeams || !lamp.on || !Beam::is_narrow(lamp)) continue;
    if (const auto beam = find_beam(present, evaluation, votes, light, seed))
      beams.push_back(*beam);
  }
  return beams;
}

}  // namespace deltalux::gather
