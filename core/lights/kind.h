// SPDX-License-Identifier: Apache-2.0
// What a kind of light without a surface can do: all that paths, shadow rays and plans ask of it.
#pragma once
#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "base/vec.h"

namespace deltalux::lights {

class Kind;

/// A light without a surface, where it is now: a value. What it does is its kind's.
struct Punctual {
  const Kind* kind = nullptr;     ///< null: nothing, as of luminous triangles
  Vec3f position{}, direction{};  ///< world; its axis, unit
  Vec3f intensity{};  ///< where it is strongest: power per steradian; of a parallel one, per area
  std::vector<float> parameters;         ///< what its kind has besides
  Vec3f frame_u{}, frame_v{}, corner{};  ///< parallel: paths begin on corner + a u + b v
  double area = 0;                       ///< of that rectangle
};

/// Where a path begins.
struct Start {
  Vec3f origin, direction;
};

/// From a receiver to a light, which ends at `to` lengths of `direction`.
struct ShadowRay {
  Vec3f direction;
  float to;
};

/// All lights of one kind. It has no state: there is one of each, and it lives for ever.
class Kind {
 public:
  virtual ~Kind() = default;
  /// How scenes name it.
  virtual std::string_view name() const = 0;
  /// Why a light's parameters can't be; null where they can.
  virtual const char* flaw(std::span<const float> parameters) const = 0;

  /// It shines from outside the scene along its direction, everywhere alike, and has no position;
  /// others shine from their position.
  virtual bool is_parallel() const = 0;
  /// 1 - cosine of the half angle of the cone about its direction that holds all its light; 2 where
  /// it shines all around, infinite for a parallel light.
  virtual float cone(const Punctual& light) const = 0;
  /// What follows from position and direction, in a scene within `world`.
  virtual void place(Punctual& light, const Box& world) const = 0;

  /// Power over intensity: steradians, of a parallel light square metres.
  virtual double extent(const Punctual& light) const = 0;
  /// The most of it, wherever an object takes the light.
  virtual double max_extent(const Punctual& light, const Box& world) const = 0;
  /// A path's start, drawn by power; of a parallel light the first two numbers are its place on the
  /// rectangle. `random`: in [0, 1).
  virtual Start start(const Punctual& light, const std::array<float, 4>& random) const = 0;

  /// Irradiance where nothing is between, over intensity. The surface is off by up to `slack`.
  virtual double irradiance(const Punctual& light, Vec3f point, Vec3f normal,
                            float slack) const = 0;
  virtual ShadowRay shadow_ray(const Punctual& light, Vec3f origin) const = 0;
};

}  // namespace deltalux::lights
