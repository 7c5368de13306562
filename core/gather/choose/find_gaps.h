// SPDX-License-Identifier: Apache-2.0
// Finds slits and small holes between corners of the scene's triangles, through which samples see
// far brighter places. Hardly any ray passes by chance.
#pragma once
#include <span>
#include <vector>

#include "gather/choose/sight_lines.h"

namespace deltalux::gather {

/// Returns guides in the planes of triangles beside whose corners `looks`, by receiver, found such
/// openings; at most `most`. `receivers`: those that looked.
std::vector<Guide> find_gaps(const Eyes& eyes, std::span<const direct::Receiver* const> receivers,
                             std::span<const Look> looks, size_t most, const Progress& progress);

/// Whether the line passes the square of one of the guides.
bool passes(std::span<const Guide> guides, Vec3f from, Vec3f w);

}  // namespace deltalux::gather
