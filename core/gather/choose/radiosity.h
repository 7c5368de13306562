// SPDX-License-Identifier: Apache-2.0
// The light that a ray sees where it lands, when places are searched that are bright.
#pragma once
#include "gather/cells/cells.h"
#include "gather/hits/chain.h"
#include "gather/hits/evaluate.h"

namespace deltalux::gather {

/// What a ray meets; kNoCell: nothing that has a cell.
struct Met {
  trace::Hit hit;
  uint32_t cell = kNoCell;
};
Met meet(const Context& context, const CellFinder& finder, Vec3f origin, Vec3f w);

/// Sum of the channels of the radiosity at a ray's hit in this cell, with the light of those suns
/// that no cell counts; that of beams is left out.
float radiosity_at(const Context& context, const Evaluation& evaluation, Vec3f origin, Vec3f w,
                   const trace::Hit& hit, uint32_t cell);

}  // namespace deltalux::gather
