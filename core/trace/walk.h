// SPDX-License-Identifier: Apache-2.0
// Light paths: emission, tracing to the next surface, survival and scattering there. Everything is
// a pure function of (seed, path, bounce) and of the scene's state.
#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/scene.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::trace {

/// A ray that leaves a light or a surface, with the power that it carries, in integer quanta.
struct Flight {
  Vec3f origin;
  uint32_t direction = 0;  ///< encoded, see base/direction.h
  uint32_t power[3] = {0, 0, 0};
  uint32_t path = 0;
};

/// Where a segment ends, and what continues from there.
struct Interaction {
  float length = 0;  ///< to the first hit, or to the border of the world box
  /// to the second hit or the border, at most `second_reach` beyond the first hit
  float extended = 0;
  uint32_t primitive = scene::kNone;
  bool survives = false;
  surfaces::Lobe lobe = surfaces::Lobe::diffuse;  ///< in which it survives
  Flight next;
};

/// The quantum of power of the brightest paths, in watts (or lumens). A path's initial power takes
/// at most 31 bits, so that sums over 2^32 segments fit into 63 bits, and fewer if there may be
/// more segments. Lights whose paths are much darker have a finer quantum of their own, since a sun
/// on a wide site would leave a lamp's path no quantum at all.
struct EnergyScale {
  static constexpr int kMostDigits = 30;
  double quantum = 1;
  int digits = kMostDigits;  ///< binary digits of the power of the brightest path, in quanta
  /// The number of paths for which no sum can overflow: each of their segments adds at most
  /// 2^(digits + 1) quanta, since one bit is left for lights that are added later.
  uint64_t most_paths(uint32_t max_bounces) const {
    return (uint64_t(1) << (62 - digits)) / max_bounces;
  }
  /// The quantum of a light of this fineness.
  double of(int finer) const { return std::ldexp(quantum, -finer); }
};

/// Power in whole quanta. Few quanta are rounded up or down at random, so that repeated rounding
/// loses nothing on average; for many, the nearest number is as good.
inline uint32_t whole_quanta(double quanta, float random) {
  constexpr double kMany = 0x1p20;
  return uint32_t(quanta + (quanta < kMany ? double(random) : 0.5));
}

/// Traces paths through the present scene.
class Walk {
 public:
  struct Options {
    uint64_t seed = 1;
    uint32_t batches = 8;
    uint32_t max_bounces = 1000;  ///< segments per path
    bool second_hit = false;      ///< compute Interaction::extended
    float second_reach = 1e30f;   ///< at most this far beyond the first hit
    bool static_only = false;     ///< ignore movable objects
  };

  Walk(const scene::Scene& scene, const RayCaster& caster, const Options& options)
      : scene_(scene), caster_(caster), options_(options) {}

  /// The first ray of path `index` of `light`; `quanta` from birth_quanta().
  Flight birth(const Light& light, uint64_t index, const Vec3d& quanta) const;
  /// The same for a path with a given start.
  Flight birth(const Light& light, uint64_t index, const Emission& start,
               const Vec3d& quanta) const;
  /// How many flights are traced before they are scattered, so that what surfaces read arrives
  /// meanwhile.
  static constexpr size_t kTogether = 16;
  /// Traces `flight`: its first hit.
  Hit meet(const Flight& flight) const;
  /// Begins to bring what scatter() reads of the surfaces of several hits into the cache.
  void fetch(std::span<const Hit> hits) const;
  /// Scatters at the first hit.
  Interaction scatter(const Flight& flight, uint32_t bounce, const Hit& hit) const;
  /// Traces `flight`, and scatters at its hit.
  Interaction fly(const Flight& flight, uint32_t bounce) const {
    return scatter(flight, bounce, meet(flight));
  }
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

/// Chooses the quantum so that no sum over all segments exceeds 63 bits.
EnergyScale choose_scale(std::span<const Light> lights, uint32_t max_bounces);
/// Bounds of the fineness, so that sums of different fineness are comparable in 128 bits.
inline constexpr int kLeastFineness = -18, kMostFineness = 45;
/// The fineness (Light::finer) of a light with its present paths: its brightest path carries at
/// least 2^20 quanta, so that rounding takes less than a millionth of it. Lights of similar
/// brightness have the same. A pure function of the scale and of this light.
int choose_fineness(const Light& light, const EnergyScale& scale);
/// The mean power of the light's paths, times `factor`, in its quanta. Throws OptionError on
/// overflow.
Vec3d birth_quanta(const Light& light, const EnergyScale& scale, double factor);

}  // namespace deltalux::trace
