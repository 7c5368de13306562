// SPDX-License-Identifier: Apache-2.0
// Receivers that things which never move stand close around.
#pragma once
#include "gather/chain.h"
#include "gather/directions.h"

namespace deltalux::gather {

class SlitFinder {
 public:
  SlitFinder(const Present& present, uint64_t seed);
  /// Whether nearly all rays of a receiver end near it, on what does not move. What moves can't
  /// open such a place, so light may be told by few rays if it is told well by them once.
  bool operator()(const direct::Receiver& receiver) const;

 private:
  const Present& present_;
  CellFinder finder_;
  Directions directions_;
};

}  // namespace deltalux::gather
