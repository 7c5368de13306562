// SPDX-License-Identifier: Apache-2.0
// How large the squares of a body's planes are: as large as asked, unless there would be too many.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// About how far away the surroundings of a plane are, which consists of the given triangles.
using Distance = std::function<double(std::span<const uint32_t> triangles)>;

/// Distances from planes of the static geometry: the harmonic mean along rays from points on the
/// side where it is smaller. A pure function of static geometry.
Distance distance_to_surroundings(const scene::Scene& scene, const trace::RayCaster& caster);

/// A plane of a body.
struct PlaneSize {
  std::span<const uint32_t> triangles;
  double area;
};

/// Edge lengths of the squares of each plane: at least `edge`. The facets of a sky dome or the
/// triangles of a landscape would have millions of such squares. Then squares grow with the
/// distance from their surroundings, where they look small from everywhere, as far as that saves
/// enough or until they look as large as those of a room; and beyond, all grow. Without `distance`
/// all do.
std::vector<double> square_edges(std::span<const PlaneSize> planes, double edge,
                                 const Distance& distance);

}  // namespace deltalux::gather
