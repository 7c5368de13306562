// SPDX-License-Identifier: Apache-2.0
// Thin sheets that light passes straight: window panes, and surfaces that cover only a part of
// their area, as blended ones do.
#pragma once
#include "surfaces/kind.h"

namespace deltalux::surfaces {

/// What a pane is made of. Its surface is three in one, side by side: gaps, glass, and a diffuse
/// rest.
struct PaneParameters {
  float coverage = 1;      ///< share of the area that is not gaps; they let all light pass
  float transmission = 1;  ///< share of the covered area that is glass; the rest is diffuse
  float index = 1.5f;      ///< of refraction, of the glass; 1: it mirrors nothing
  /// 1: light meets one smooth face. 2: it passes a plate, between whose faces it goes to and fro.
  float faces = 1;
  float inner = 1;  ///< share of the light that is not absorbed on the shortest way through a plate
  float tint = 1;   ///< a further factor on what passes the glass
};

/// The parameters in the order of Surface::parameters.
std::vector<float> parameters_of(const PaneParameters& pane);

/// Shares of light that go on in each lobe; the rest is absorbed.
struct PaneShares {
  float straight, mirrored, diffuse;
};
/// Glass is by Fresnel's equations, as a mean over both polarisations; a plate with all reflections
/// between its faces: CIE 171:2006, section 5.10. `cosine`: of the angle between light and normal.
PaneShares shares_of(const PaneParameters& pane, double cosine);

/// The kind "pane"; and that of panes with textures, see textured().
const Kind& pane();
const Kind& textured_pane();

}  // namespace deltalux::surfaces
