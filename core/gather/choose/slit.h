// SPDX-License-Identifier: Apache-2.0
// Finds receivers in slits between static surfaces.
#pragma once
#include "gather/aim/directions.h"
#include "gather/hits/chain.h"

namespace deltalux::gather {

class SlitFinder {
 public:
  SlitFinder(const Context& context, uint64_t seed);
  /// Whether almost all rays of a receiver end near it, on static geometry. Movable objects cannot
  /// open such a slit, so that fewer rays suffice if they sufficed once.
  bool operator()(const direct::Receiver& receiver) const;

 private:
  const Context& context_;
  CellFinder finder_;
  Directions directions_;
};

}  // namespace deltalux::gather
