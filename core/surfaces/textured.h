// SPDX-License-Identifier: Apache-2.0
// Makes textured surfaces, which are no kind by name: they need a texture.
#pragma once
#include "surfaces/kind.h"
#include "surfaces/texture.h"

namespace deltalux::surfaces {

/// The surface with its reflectance where texels have their mean, and in proportion elsewhere; its
/// mean where a triangle has no texture coordinates.
Surface textured(Surface surface, TextureMap map);

}  // namespace deltalux::surfaces
