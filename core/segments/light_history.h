// SPDX-License-Identifier: Apache-2.0
// What has happened to the light of a segment: it decides who counts it.
#pragma once
#include <cstdint>

#include "surfaces/kind.h"

namespace deltalux::segments {

/// Direct light comes straight from a lamp, through whatever lets it pass (shadow rays may compute
/// it). A caustic was sent on by specular lobes only: no gather ray finds its lamp, so that discs
/// count it. Indirect light has met a diffuse lobe.
enum class LightHistory : uint8_t { direct, caustic, indirect };

/// The history after one more surface.
constexpr LightHistory after(LightHistory before, surfaces::Lobe lobe) {
  using surfaces::Lobe;
  if (lobe == Lobe::straight) return before;
  return lobe == Lobe::diffuse || before == LightHistory::indirect ? LightHistory::indirect
                                                                   : LightHistory::caustic;
}

}  // namespace deltalux::segments
