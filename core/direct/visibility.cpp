// SPDX-License-Identifier: Apache-2.0
// Visibility of one light from one receiver, by shadow rays.
#include "direct/visibility.h"

#include <algorithm>
#include <cmath>

#include "direct/cover.h"
#include "direct/refinement.h"
#include "direct/view_code.h"

namespace deltalux::direct {
namespace {

using trace::RayBits;

constexpr RayBits kNoRays{};
// Irradiance over radiance (pi for the whole sky). A light that gives more than this where it is
// visible is not hidden because all rays are blocked, unless surfaces are known to cover it.
constexpr double kNotable = 0.005;
// Error of a light all of whose rays are blocked: in shares of a ray.
constexpr float kUnseen = 0.25f;

/// Whether the light may be seen though all coarse rays are blocked.
bool may_show(const LightShape& light, const Receiver& receiver, double open) {
  return open > kNotable && !light.is_minor(receiver);
}

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

/// The countable rays that neither the receiver's own object nor static geometry blocks.
RayBits pass_fixed(const trace::RayCaster& caster, const Receiver& receiver, const Strata& rays) {
  RayBits free = rays.countable;
  if (receiver.object != scene::kNone)
    free = without(free, caster.occluded_object(receiver.object, rays.fan, free));
  return free == kNoRays ? free : without(free, caster.occluded_static(rays.fan, free));
}

/// The share by the fine strata of which `free` are visible, with strata divided where needed.
/// `divided` tells whether they were.
Seen resolve(const LightShape& light, const Receiver& receiver, double open, const Strata& fine,
             const RayBits& free, const FreeRays& free_rays, bool& divided) {
  const bool none = free == kNoRays, is_fine = fine.fan.count == kFineRays;
  divided = false;
  const bool divides = is_fine && open > kNotable && light.is_major(open);
  if (none && !divides) return {0, kUnseen / float(fine.fan.count)};
  const Seen seen = by_strata(fine, free);
  if (!divides || (!none && !is_rough(seen))) return seen;
  divided = true;
  Seen found = refine(light, receiver, fine, free, free_rays);
  if (!(found.share > 0)) found.error = kUnseen / (kFineRays * kParts * kParts);
  return found;
}

}  // namespace

FixedView fixed_view(const trace::RayCaster& caster, const LightShape& light,
                     const Receiver& receiver, double open) {
  using Kind = FixedView::Kind;
  if (!(open > 0)) return {};
  FixedView view;
  Strata strata;
  bool ask_own = receiver.object != scene::kNone, ask_static = true;
  const auto free_rays = [&](const Strata& rays) {
    RayBits free = rays.countable;
    if (ask_own) free = without(free, caster.occluded_object(receiver.object, rays.fan, free));
    ask_own = ask_own && free != rays.countable;
    if (!ask_static || free == kNoRays) return free;
    const RayBits blocked = caster.occluded_static(rays.fan, free);
    ask_static = blocked != kNoRays;
    return without(free, blocked);
  };
  light.cast(receiver, Detail::coarse, strata);
  const bool too_coarse = strata.too_coarse;
  if (!too_coarse) {
    const RayBits free = free_rays(strata);
    if (free == strata.countable) return {Kind::open, 0, {}, {}, false};
    view.kind = Kind::hidden;
    if (free == kNoRays &&
        (!may_show(light, receiver, open) || is_covered(caster, light, receiver, {})))
      return view;
    view.coarse = free[0];
  }
  const bool needs_own = ask_own, needs_static = ask_static;
  light.cast(receiver, Detail::fine, strata);
  view.fine = free_rays(strata);
  if (too_coarse && view.fine == strata.countable) return {Kind::open, 0, {}, {}, false};
  if (too_coarse && view.fine == kNoRays && is_covered(caster, light, receiver, {}))
    return {Kind::hidden, 0, {}, {}, false};
  view.seen = resolve(
      light, receiver, open, strata, view.fine,
      [&](const Strata& rays) {
        ask_own = needs_own, ask_static = needs_static;
        return free_rays(rays);
      },
      view.divided);
  view.seen.error = error_of(error_code(view.seen.error));  // as it is stored
  view.kind = view.seen.share > 0 ? Kind::partial : Kind::hidden;
  return view;
}

namespace {

/// The share that nothing blocks, see visible_share().
Seen unblocked_share(const trace::RayCaster& caster, const LightShape& light,
                     const Receiver& receiver, double open_light, const FixedView& fixed,
                     std::span<const uint32_t> movables) {
  using Kind = FixedView::Kind;
  if (fixed.kind == Kind::empty) return {};
  if (fixed.kind == Kind::hidden) return {0, fixed.seen.error};
  const bool open = fixed.kind == Kind::open;
  const Seen as_fixed = open ? Seen{1, 0} : fixed.seen;
  if (movables.empty()) return as_fixed;
  Strata strata;
  light.cast(receiver, Detail::coarse, strata);
  bool blocks = strata.too_coarse;
  if (!strata.too_coarse) {
    // Fine rays may get through where all coarse ones are blocked.
    const RayBits free =
        open || fixed.divided || !fixed.coarse ? strata.countable : RayBits{fixed.coarse, 0, 0, 0};
    const RayBits seen = pass(caster, strata.fan, free, movables);
    if (seen == kNoRays &&
        (!may_show(light, receiver, open_light) || is_covered(caster, light, receiver, movables)))
      return {};
    blocks = seen != free;
  }
  if (!blocks && !fixed.divided) return as_fixed;
  light.cast(receiver, Detail::fine, strata);
  const RayBits asked = open || fixed.divided ? strata.countable : fixed.fine;
  RayBits seen = pass(caster, strata.fan, asked, movables);
  if (!blocks && seen == asked) return as_fixed;
  if (fixed.divided)
    seen = {seen[0] & fixed.fine[0], seen[1] & fixed.fine[1], seen[2] & fixed.fine[2],
            seen[3] & fixed.fine[3]};
  const auto free_rays = [&](const Strata& rays) {
    return pass(caster, rays.fan, pass_fixed(caster, receiver, rays), movables);
  };
  bool divided = false;
  return resolve(light, receiver, open_light, strata, seen, free_rays, divided);
}

/// The mean transmittance along rays, weighted by what they represent, and whether it varies.
struct Dimming {
  double mean = 1, range = 0;
};
Dimming dimming_of(const trace::RayCaster& caster, const Strata& rays, const RayBits& free) {
  double all = 0, sum = 0, low = 1, high = 0;
  for (size_t i = 0; i < rays.fan.count; ++i) {
    if (!(free[i / 64] >> (i % 64) & 1) || !(rays.weight[i] > 0)) continue;
    const Vec3f way{rays.fan.x[i], rays.fan.y[i], rays.fan.z[i]};
    const double own = double(caster.transmittance(rays.fan.origin, way, rays.fan.to));
    all += double(rays.weight[i]), sum += double(rays.weight[i]) * own;
    low = std::min(low, own), high = std::max(high, own);
  }
  return all > 0 ? Dimming{sum / all, high - low} : Dimming{};
}

}  // namespace

Seen visible_share(const trace::RayCaster& caster, const LightShape& light,
                   const Receiver& receiver, double open, const FixedView& fixed,
                   std::span<const uint32_t> movables) {
  const Seen seen = unblocked_share(caster, light, receiver, open, fixed, movables);
  if (!caster.transmits() || !(seen.share > 0)) return seen;
  Strata rays;
  const auto dimming = [&](Detail detail) {
    light.cast(receiver, detail, rays);
    const RayBits free = pass(caster, rays.fan, pass_fixed(caster, receiver, rays), movables);
    return dimming_of(caster, rays, free == kNoRays ? rays.countable : free);
  };
  Dimming own = dimming(Detail::coarse);
  if (own.range > 0 || rays.too_coarse) own = dimming(Detail::fine);
  // An edge between two values goes through few of the strata.
  const double error = own.range * std::pow(double(rays.fan.count), -0.75);
  return {seen.share * own.mean, float(double(seen.error) * own.mean + seen.share * error)};
}

double coarse_share(const trace::RayCaster& caster, const LightShape& light,
                    const Receiver& receiver, std::optional<uint32_t> third,
                    std::span<const uint32_t> movables) {
  Strata strata;
  light.cast(receiver, Detail::coarse, strata);
  // The rays to the light's extremities have no weight.
  strata.fan.count = std::min<size_t>(strata.fan.count, kCoarseRays);
  uint64_t& asked = strata.countable[0];
  asked &= kCoarseBits;
  if (third) {
    const uint64_t some = asked & few_rays(*third);
    if (some) asked = some;
  }
  if (!asked) return 0;  // only a sliver of the light is in front of the receiver
  const RayBits free = pass_fixed(caster, receiver, strata);
  const RayBits seen = pass(caster, strata.fan, free, movables);
  const double share = strata.share(seen);
  return caster.transmits() ? share * dimming_of(caster, strata, seen).mean : share;
}

}  // namespace deltalux::direct
