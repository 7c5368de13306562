// SPDX-License-Identifier: Apache-2.0
// How much of a light reaches a receiver: what the static scene and the receiver's own object leave
// (kept), what other movables leave of that (asked again after every edit). Both are pure functions
// of the present state.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "direct/light_shape.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// What the static scene and the receiver's own object leave of a light: the same until the light
/// or the receiver changes. The rules:
/// - 36 rays and 4 to the light's ends. All free: open. All blocked: hidden. Else 256 rays tell.
/// - Where the light is near or large, 256 rays from the start.
/// - The own object is asked first: it hides most that is hidden, and is soon asked.
/// - What blocks none of the 40 is not asked for the 256: static scene, own object, other movables.
struct FixedView {
  enum class Kind : uint8_t { empty, hidden, open, partial };  ///< empty: light not in front
  Kind kind = Kind::empty;
  uint64_t coarse = 0;    ///< partial: free coarse rays
  trace::RayBits fine{};  ///< partial: free fine rays
  double share = 0;       ///< partial: of the light, by the fine rays
};

FixedView look(const trace::RayCaster& caster, const LightShape& light, const Receiver& receiver);

/// Share of the light that reaches the receiver, in [0, 1]: exactly 1 in the open, exactly 0 where
/// no ray comes through. `movables`: every other present object that may stand in between,
/// ascending.
double visible_share(const trace::RayCaster& caster, const LightShape& light,
                     const Receiver& receiver, const FixedView& fixed,
                     std::span<const uint32_t> movables);

/// The same by the coarse rays alone, or by twelve of them: `third` is which, 0 to 2.
double coarse_share(const trace::RayCaster& caster, const LightShape& light,
                    const Receiver& receiver, std::optional<uint32_t> third,
                    std::span<const uint32_t> movables);

}  // namespace deltalux::direct
