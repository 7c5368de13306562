// SPDX-License-Identifier: Apache-2.0
// Integer units of direct light: each light has its own, so that none is lost beside a brighter
// one.
#pragma once
#include <span>

#include "trace/lights.h"

namespace deltalux::direct {

/// Upper bound of what one light adds to one sample, in quanta; only reached close to point lights.
/// The sums of 127 such lights still fit.
inline constexpr double kMaxWeight = 0x1p56;

/// Units of direct light; fixed at the bake, since the choice of shadow rays depends on them.
struct Scales {
  double quantum = 1;    ///< irradiance per unit of the sums of the brightest lights
  double reference = 0;  ///< what receivers get from all lights if nothing hides these; 0: unknown
  double metre = 1;      ///< a distance that is typical of the scene
};

/// The scales of a scene with these lights, without a reference. They do not depend on poses.
Scales choose_scales(std::span<const trace::Light> lights, double metre);

/// Irradiance per quantum of this light: Scales::quantum times a power of 2, which similar lights
/// share. A light may be added that is fainter or brighter than all others.
double quantum_of(const trace::Light& light, const Scales& scales);

}  // namespace deltalux::direct
