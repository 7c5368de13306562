// SPDX-License-Identifier: Apache-2.0
// How much of a light reaches a receiver: FixedView holds what static geometry and the receiver's
// own object leave of it, and is kept; the effect of other movable objects is tested again after
// every edit. Both are pure functions of the present state.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "direct/light_shape.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// The share of a light that reaches a receiver, in [0, 1], and the standard error of that.
struct Seen {
  double share = 0;
  float error = 0;
};

/// The visibility of a light, considering static geometry and the receiver's own object. It stays
/// the same until the light or the receiver changes. The rules:
/// - Cast 36 rays, and 4 to the light's extremities (12 and 4 if it is small as seen from there; a
///   single one if it is faint). All free: open. All blocked: hidden, unless the light gives much
///   where it is not. Otherwise cast 256 rays.
/// - If the light is close or large, cast the 256 rays at once.
/// - If these leave the share uncertain, divide strata, and their parts in turn, see refine().
/// - Test the receiver's own object first: it causes most occlusion and is cheap.
/// - An occluder (own object, static geometry, other movables) that blocks none of the 40 rays is
///   not tested with the 256.
struct FixedView {
  /// empty: the light is not in front of the receiver
  enum class Kind : uint8_t { empty, hidden, open, partial };
  Kind kind = Kind::empty;
  uint64_t coarse = 0;    ///< of `partial`: unoccluded coarse rays
  trace::RayBits fine{};  ///< of `partial`: unoccluded fine rays
  Seen seen{};            ///< of `partial`, and the error of `hidden`
  bool divided = false;   ///< of `partial`: whether strata were divided
};

/// Computes the visibility of the light from the receiver; `open` is LightShape::open() of both.
FixedView fixed_view(const trace::RayCaster& caster, const LightShape& light,
                     const Receiver& receiver, double open);

/// The share of the light that reaches the receiver: exactly 1 if nothing is in between, exactly 0
/// if no ray gets through. What lets light pass dims it. `movables`: the other present objects that
/// may stand in between, in ascending order.
Seen visible_share(const trace::RayCaster& caster, const LightShape& light,
                   const Receiver& receiver, double open, const FixedView& fixed,
                   std::span<const uint32_t> movables);

/// The same by the coarse rays alone, or by twelve of them; `third` (0 to 2) says which twelve.
double coarse_share(const trace::RayCaster& caster, const LightShape& light,
                    const Receiver& receiver, std::optional<uint32_t> third,
                    std::span<const uint32_t> movables);

}  // namespace deltalux::direct
