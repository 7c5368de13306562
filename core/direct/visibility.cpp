// SPDX-License-Identifier: Apache-2.0
// Visibility of one light from one receiver, by shadow rays.
#include "direct/visibility.h"

#include <algorithm>

namespace deltalux::direct {
namespace {

using trace::RayBits;

constexpr RayBits kNoRays{};
// A third of the coarse rays, equally many in each row and column of the strata.
constexpr uint64_t kFew = 0x88c462311;
static_assert(kCoarseRays == 36);
constexpr uint64_t kCoarse = (uint64_t(1) << kCoarseRays) - 1;

RayBits without(const RayBits& a, const RayBits& b) {
  return {a[0] & ~b[0], a[1] & ~b[1], a[2] & ~b[2], a[3] & ~b[3]};
}

/// The rays of `free` that none of `movables` blocks.
RayBits pass(const trace::RayCaster& caster, const trace::RayFan& fan, RayBits free,
             std::span<const uint32_t> movables) {
  for (uint32_t object : movables)
    if (free != kNoRays) free = without(free, caster.occluded_object(object, fan, free));
  return free;
}

}  // namespace

FixedView fixed_view(const trace::RayCaster& caster, const LightShape& light,
                     const Receiver& receiver) {
  using Kind = FixedView::Kind;
  if (!(light.open(receiver) > 0)) return {};
  FixedView view;
  Strata strata;
  bool ask_own = receiver.object != scene::kNone, ask_static = true;
  const auto free_rays = [&] {
    RayBits free = strata.countable;
    if (ask_own) free = without(free, caster.occluded_object(receiver.object, strata.fan, free));
    ask_own = ask_own && free != strata.countable;
    if (!ask_static || free == kNoRays) return free;
    const RayBits blocked = caster.occluded_static(strata.fan, free);
    ask_static = blocked != kNoRays;
    return without(free, blocked);
  };
  const auto kind = [&](const RayBits& free) {
    return free == kNoRays ? Kind::hidden : free == strata.countable ? Kind::open : Kind::partial;
  };
  light.cast(receiver, Detail::coarse, strata);
  const bool too_coarse = strata.too_coarse;
  if (!too_coarse) {
    const RayBits free = free_rays();
    view.kind = kind(free);
    if (view.kind != Kind::partial) return view;
    view.coarse = free[0];
  }
  light.cast(receiver, Detail::fine, strata);
  view.fine = free_rays();
  view.share = strata.share(view.fine);
  if (too_coarse) view.kind = kind(view.fine);
  return view;
}

double visible_share(const trace::RayCaster& caster, const LightShape& light,
                     const Receiver& receiver, const FixedView& fixed,
                     std::span<const uint32_t> movables) {
  using Kind = FixedView::Kind;
  if (fixed.kind == Kind::empty || fixed.kind == Kind::hidden) return 0;
  const bool open = fixed.kind == Kind::open;
  const double share = open ? 1 : fixed.share;
  if (movables.empty()) return share;
  Strata strata;
  light.cast(receiver, Detail::coarse, strata);
  if (!strata.too_coarse) {
    const RayBits free = open ? strata.countable : RayBits{fixed.coarse, 0, 0, 0};
    const RayBits seen = pass(caster, strata.fan, free, movables);
    if (seen == kNoRays) return 0;
    if (seen == free) return share;
  }
  light.cast(receiver, Detail::fine, strata);
  return strata.share(pass(caster, strata.fan, open ? strata.countable : fixed.fine, movables));
}

double coarse_share(const trace::RayCaster& caster, const LightShape& light,
                    const Receiver& receiver, std::optional<uint32_t> third,
                    std::span<const uint32_t> movables) {
  Strata strata;
  light.cast(receiver, Detail::coarse, strata);
  // The rays to the light's extremities have no weight.
  strata.fan.count = std::min<size_t>(strata.fan.count, kCoarseRays);
  uint64_t& asked = strata.countable[0];
  asked &= kCoarse;
  if (third) {
    const uint32_t turn = 3 * *third;
    const uint64_t some = asked & (kFew << turn | kFew >> (kCoarseRays - turn));
    if (some) asked = some;
  }
  if (!asked) return 0;  // only a sliver of the light is in front of the receiver
  RayBits free = strata.countable;
  if (receiver.object != scene::kNone)
    free = without(free, caster.occluded_object(receiver.object, strata.fan, free));
  if (free != kNoRays) free = without(free, caster.occluded_static(strata.fan, free));
  return strata.share(pass(caster, strata.fan, free, movables));
}

}  // namespace deltalux::direct
