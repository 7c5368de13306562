// SPDX-License-Identifier: Apache-2.0
// Shadow rays of one receiver and one light.
#include "direct/visibility.h"

namespace deltalux::direct {
namespace {

using trace::RayBits;

constexpr RayBits kNoRays{};

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

StaticView look(const trace::RayCaster& caster, const LightShape& light, const Receiver& receiver) {
  if (!(light.open(receiver) > 0)) return {};
  StaticView view;
  Strata strata;
  light.cast(receiver, Level::coarse, strata);
  RayBits free;
  const auto examine = [&] {
    free = without(strata.countable, caster.occluded_static(strata.fan, strata.countable));
    view.kind = free == kNoRays            ? StaticView::Kind::hidden
                : free == strata.countable ? StaticView::Kind::open
                                           : StaticView::Kind::partial;
  };
  const bool too_coarse = strata.too_coarse;
  if (!too_coarse) {
    examine();
    view.coarse = free[0];
    if (view.kind != StaticView::Kind::partial) return view;
  }
  light.cast(receiver, Level::fine, strata);
  if (too_coarse) {
    examine();
    view.fine = free;
  } else {
    view.fine = without(strata.countable, caster.occluded_static(strata.fan, strata.countable));
  }
  return view;
}

double visible_share(const trace::RayCaster& caster, const LightShape& light,
                     const Receiver& receiver, const StaticView& still,
                     std::span<const uint32_t> movables) {
  using Kind = StaticView::Kind;
  if (still.kind == Kind::empty || still.kind == Kind::hidden) return 0;
  if (still.kind == Kind::open && movables.empty()) return 1;
  Strata strata;
  if (!movables.empty()) {
    light.cast(receiver, Level::coarse, strata);
    if (!strata.too_coarse) {
      const RayBits free =
          still.kind == Kind::open ? strata.countable : RayBits{still.coarse, 0, 0, 0};
      const RayBits seen = pass(caster, strata.fan, free, movables);
      if (seen == kNoRays) return 0;
      if (seen == strata.countable) return 1;
    }
  }
  light.cast(receiver, Level::fine, strata);
  const RayBits free = still.kind == Kind::open ? strata.countable : still.fine;
  return strata.share(pass(caster, strata.fan, free, movables));
}

}  // namespace deltalux::direct
