// SPDX-License-Identifier: Apache-2.0
// Light paths: birth on a light, one flight to the next surface, survival and scattering there.
// Everything is a pure function of (seed, path, bounce) and of the scene's state.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/scene.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::trace {

/// A particle that leaves a light or a surface. Power is in integer quanta from birth on.
struct Flight {
  Vec3f origin;
  uint32_t direction = 0;  ///< code, see base/direction.h
  uint32_t power[3] = {0, 0, 0};
  uint32_t path = 0;
};

/// Where a flight ends and what leaves from there.
struct Interaction {
  float length = 0;    ///< to the first hit, or to the world's border
  float extended = 0;  ///< to the second hit or the border, at most `reach` beyond the first
  uint32_t primitive = scene::kNone;
  bool survives = false;
  Flight next;
};

/// Energy scale: watts (or lumens) per quantum. A path's power at birth takes at most 31 bits, so
/// sums of 2^32 crossings fit 63 bits.
struct EnergyScale {
  double quantum = 1;
};

class Walk {
 public:
  struct Options {
    uint64_t seed = 1;
    uint32_t batches = 8;
    uint32_t max_bounces = 64;   ///< flights per path
    bool second_hit = false;     ///< look for `extended`
    float second_reach = 1e30f;  ///< no further than this beyond the first hit
    bool static_only = false;    ///< as if there were no movable objects
  };

  Walk(const scene::Scene& scene, const RayCaster& caster, const Options& options)
      : scene_(scene), caster_(caster), options_(options) {}

  /// First flight of path `index` of `light`; `quanta` from birth_quanta().
  Flight birth(const Light& light, uint64_t index, const std::array<uint32_t, 3>& quanta) const;
  /// The same of a path that begins so.
  Flight birth(const Light& light, uint64_t index, const Emission& start,
               const std::array<uint32_t, 3>& quanta) const;
  /// Traces `flight` and scatters it.
  Interaction fly(const Flight& flight, uint32_t bounce) const;
  /// The same for a first hit that is known already.
  Interaction scatter(const Flight& flight, uint32_t bounce, const Hit& hit) const;
  /// Calls visit(flight, interaction, bounce) for each flight of the path that begins so.
  template <class Visit>
  void follow(Flight flight, const Visit& visit) const {
    for (uint32_t bounce = 0;; ++bounce) {
      const Interaction interaction = fly(flight, bounce);
      visit(flight, interaction, bounce);
      if (!interaction.survives) return;
      flight = interaction.next;
    }
  }

 private:
  const scene::Scene& scene_;
  const RayCaster& caster_;
  Options options_;
};

/// Scale for which no path's power at birth exceeds 31 bits, nor any sum of
/// `paths` * `max_bounces` crossings 63 bits. Throws OptionError where that is impossible.
EnergyScale choose_scale(std::span<const Light> lights, uint32_t max_bounces);
/// Mean power of the paths of `light`, times `factor`, in quanta. Throws OptionError on overflow.
std::array<uint32_t, 3> birth_quanta(const Light& light, const EnergyScale& scale, double factor);

}  // namespace deltalux::trace
