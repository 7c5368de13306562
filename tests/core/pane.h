// SPDX-License-Identifier: Apache-2.0
// Panes for tests.
#pragma once
#include "scene/scene.h"
#include "surfaces/pane.h"

namespace deltalux::surfaces {

inline Surface pane_with(const PaneParameters& own, Vec3f reflectance = {}) {
  return {reflectance, {}, false, &pane(), parameters_of(own), "pane"};
}

/// Mirrors nothing; `passes`: the share of light that passes at a right angle.
inline Surface dimming_pane(float passes) {
  PaneParameters own;
  own.index = 1, own.faces = 2, own.inner = passes;
  return pane_with(own);
}

}  // namespace deltalux::surfaces
