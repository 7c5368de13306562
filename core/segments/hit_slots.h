// SPDX-License-Identifier: Apache-2.0
// The static discs that a segment crosses, remembered so that its removal needs no search.
#pragma once
#include <cstdint>

namespace deltalux::segments {

/// Up to two disc indices of the static DiscSet. If there are more, the first entry is kMany.
/// Unused entries are kFree.
struct HitSlots {
  static constexpr uint32_t kFree = 0xffffffffu, kMany = 0xfffffffeu;
  uint32_t disc[2] = {kFree, kFree};
};

}  // namespace deltalux::segments
