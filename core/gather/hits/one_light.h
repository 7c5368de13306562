// SPDX-License-Identifier: Apache-2.0
// Estimates direct light at a point by one shadow ray.
#pragma once
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "gather/hits/light_tree.h"
#include "gather/hits/vertex.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// Two random numbers in [0, 1).
using Draw = std::array<float, 2>;

class OneLight {
 public:
  /// A group of more lights than this has a tree of them, whose choices depend on all of them.
  static constexpr size_t kMany = 64;
  /// Chooses among the lights for which takes_part(index) holds.
  OneLight(std::span<const trace::Light> lights, const std::function<bool(uint32_t)>& takes_part,
           uint32_t groups, uint64_t seed);
  OneLight(const OneLight&) = delete;  // trees refer to the shapes
  OneLight& operator=(const OneLight&) = delete;
  /// Chooses one light with a probability that is half by its approximate unshadowed share of all
  /// light, and half by its share within its group (with equal chances for all groups that
  /// contribute), so that no group is neglected when others are dimmed. Suns hidden by static
  /// geometry are left out. Writes the light and its irradiance, divided by the probability, to
  /// `out`. Of a group of very many lights, one is chosen by a LightTree.
  void ask(const trace::RayCaster& caster, const direct::Receiver& receiver, const Draw& draw,
           Vertex& out) const;

 private:
  /// One light, or the tree of a group's many.
  struct Choice {
    uint32_t group, light;
    LightTree tree;
  };
  double weigh(const trace::RayCaster& caster, const Choice& choice,
               const direct::Receiver& receiver) const;
  void shine(const trace::RayCaster& caster, const direct::Receiver& receiver, uint32_t light,
             double chance, float u, float v, Vertex& out) const;

  std::span<const trace::Light> lights_;
  direct::Shapes shapes_;
  std::vector<Choice> choices_;
  uint32_t groups_;
};

}  // namespace deltalux::gather
