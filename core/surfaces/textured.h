// SPDX-License-Identifier: Apache-2.0
// Makes textured surfaces, which are no kind by name: they need a texture.
#pragma once
#include <optional>

#include "surfaces/kind.h"
#include "surfaces/texture.h"

namespace deltalux::surfaces {

/// The surface with its reflectance where texels have their mean, and in proportion elsewhere; its
/// mean where a triangle has no texture coordinates.
/// Of a pane, how much texels count is a further factor on its coverage.
Surface textured(Surface surface, TextureMap map);

/// The texel at a point; none where it has no texture coordinates.
std::optional<Texture::Weighted> texel_at(const TextureMap& map, const SurfacePoint& at);
/// A texel relative to the mean, as far as it counts; 1 for a channel whose mean is black.
Vec3f relative(const Texture::Weighted& texel, Vec3f gain);
/// Upper bound of that for all points of the map.
Vec3f most_relative(const TextureMap& map);
/// Begins to bring the texel into the cache.
void fetch_texel(const TextureMap& map, const SurfacePoint& at);

}  // namespace deltalux::surfaces
