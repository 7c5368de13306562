// SPDX-License-Identifier: Apache-2.0
// Estimates direct light at a point by one shadow ray.
#pragma once
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "gather/hits/light_tree.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// Two random numbers in [0, 1).
using Draw = std::array<float, 2>;

/// Why lights are asked again: something else may hide the one that was asked; or others may be
/// chosen now; or the one that was asked sends other light.
enum class Renewal : uint8_t { none, shadow, chances, light };

class OneLight {
 public:
  /// A group of more lights than this has a tree of them, whose choices depend on all of them.
  static constexpr size_t kMany = 64;
  /// Chooses among the lights for which takes_part(index) holds.
  OneLight(std::span<const trace::Light> lights, const std::function<bool(uint32_t)>& takes_part,
           uint32_t groups, uint64_t seed);
  OneLight(const OneLight&) = delete;  // trees refer to the shapes
  OneLight& operator=(const OneLight&) = delete;
  /// The light chosen, or kNone, and Vertex::direct.
  struct Answer {
    uint32_t light = scene::kNone;
    float direct = 0;
  };
  /// Chooses one light with a probability that is half by its approximate unshadowed share of all
  /// light, and half by its share within its group (with equal chances for all groups that
  /// contribute), so that no group is neglected when others are dimmed. Suns hidden by static
  /// geometry are left out. Of a group of very many lights, one is chosen by a LightTree. Which
  /// point of the light stands for it depends on the draw alone, not on the other lights.
  Answer ask(const trace::RayCaster& caster, const direct::Receiver& receiver,
             const Draw& draw) const;
  /// The same, where only what `why` says changed since `before` was the answer; sets `casts` if it
  /// cast rays. Not where surfaces let light pass.
  Answer ask_again(const trace::RayCaster& caster, const direct::Receiver& receiver,
                   const Draw& draw, const Answer& before, Renewal why, bool& casts) const;

 private:
  /// One light, or the tree of a group's many.
  struct Choice {
    uint32_t group, light;
    LightTree tree;
  };
  /// A light, and the probability of having chosen it; or kNone.
  struct Chosen {
    uint32_t light = scene::kNone;
    double chance = 0;
  };
  double weigh(const trace::RayCaster& caster, const Choice& choice,
               const direct::Receiver& receiver) const;
  Chosen choose(const trace::RayCaster& caster, const direct::Receiver& receiver,
                const Draw& draw) const;
  Answer ask(const trace::RayCaster& caster, const direct::Receiver& receiver, const Draw& draw,
             const Chosen& chosen) const;
  /// The ray to the point of a light that stands for it, and what it brings without shadows.
  direct::LightShape::Glance glance(uint32_t light, const direct::Receiver& receiver,
                                    const Draw& draw) const;

  std::span<const trace::Light> lights_;
  direct::Shapes shapes_;
  std::vector<Choice> choices_;
  uint32_t groups_;
};

}  // namespace deltalux::gather
