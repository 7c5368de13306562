// SPDX-License-Identifier: Apache-2.0
// The interface of kinds of lights without a surface: all that paths, shadow rays and planning need
// to know.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "base/transform.h"
#include "base/vec.h"

namespace deltalux::lights {

class Kind;

/// What a kind computes once from a light's parameters, such as an inverse distribution function.
struct Tables {
  virtual ~Tables() = default;
};

/// A light without a surface, in its present pose. Its behaviour is defined by its kind.
struct Punctual {
  const Kind* kind = nullptr;     ///< null for area lights
  Vec3f position{}, direction{};  ///< in world space; `direction`: unit axis
  /// Maximum intensity: power per steradian; of a parallel light, power per area.
  Vec3f intensity{};
  std::vector<float> parameters;         ///< additional parameters of its kind
  std::shared_ptr<const Tables> tables;  ///< made of these by Kind::prepare()
  /// What Kind::place() makes of the pose: parallel lights start paths at corner + a u + b v; a
  /// kind that is not the same all around its direction has its axes here.
  Vec3f frame_u{}, frame_v{}, corner{};
  double area = 0;  ///< of that rectangle
  friend bool operator==(const Punctual&, const Punctual&) = default;
};

/// The start of a path.
struct Start {
  Vec3f origin, direction;
};

/// From a receiver to a light, which is at parameter `to` along `direction`.
struct ShadowRay {
  Vec3f direction;
  float to;
};

/// Behaviour of all lights of one kind. There is one instance of each kind; what it knows of a
/// light, that light holds.
class Kind {
 public:
  virtual ~Kind() = default;
  /// Its name in scenes.
  virtual std::string_view name() const = 0;
  /// Why a light cannot have these parameters; null if it can.
  virtual const char* flaw(std::span<const float> parameters) const = 0;

  /// Whether it shines from outside of the scene, with the same intensity everywhere along its
  /// direction, and has no position.
  virtual bool is_parallel() const = 0;
  /// The versine (1 - cosine) of the half angle of the cone about its direction that contains all
  /// its light; 2 if it shines in all directions, infinite for a parallel light.
  virtual float cone(const Punctual& light) const = 0;
  /// Whether its light may reach a point of the ball; false only if none can.
  bool may_reach(const Punctual& light, Vec3f centre, float radius) const;
  bool may_reach(const Punctual& light, const Box& box) const;  ///< the same for a box
  /// Like cone(), for most of the light: gather rays may aim where a concentrated light lands.
  virtual float concentration(const Punctual& light) const { return cone(light); }
  /// The tables of a light with these parameters, which have no flaw.
  virtual std::shared_ptr<const Tables> prepare(std::span<const float>) const { return nullptr; }
  /// Computes what depends on position and direction, and on how the light is turned about its
  /// direction, for a scene within the box `world`. `pose`: of the object that carries it.
  virtual void place(Punctual& light, const Pose& pose, const Box& world) const = 0;

  /// Power over intensity: in steradians; for a parallel light in square metres.
  virtual double extent(const Punctual& light) const = 0;
  /// The largest extent() in any pose of the object that carries the light.
  virtual double max_extent(const Punctual& light, const Box& world) const = 0;
  /// Draws the start of a path in proportion to power. For a parallel light, the first two numbers
  /// determine the place on the rectangle. `random`: in [0, 1).
  virtual Start start(const Punctual& light, const std::array<float, 4>& random) const = 0;

  /// Unshadowed irradiance over intensity. `slack`: possible error of the surface's position.
  virtual double irradiance(const Punctual& light, Vec3f point, Vec3f normal,
                            float slack) const = 0;
  /// The shadow ray from `origin` to the light.
  virtual ShadowRay shadow_ray(const Punctual& light, Vec3f origin) const = 0;
};

}  // namespace deltalux::lights
