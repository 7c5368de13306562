// SPDX-License-Identifier: Apache-2.0
// An acceleration structure over triangles. Only embree_scene.cpp knows Embree (3.13 or 4).
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/progress.h"
#include "trace/hidden_parts.h"
#include "trace/ray.h"

namespace deltalux::trace {

/// The Embree device, shared by the structures made with it. Throws Error if Embree cannot be
/// started.
class EmbreeDevice {
 public:
  EmbreeDevice();
  /// Embree's version, and the instruction set in use.
  std::string description() const;

 private:
  friend class EmbreeScene;
  std::shared_ptr<void> device_;
};

/// Tells where rays pass straight through triangles.
struct Holes {
  const scene::Scene* scene;  ///< null if no surface lets rays or light pass
  uint32_t first_primitive;   ///< of the triangles
  /// Triangles in one plane: rays stop at one of them. Null if there are none.
  std::shared_ptr<const HiddenParts> hidden;
  bool transmits = false;  ///< whether some let light pass, so that shadow rays do
};

/// An immutable acceleration structure. Queries are thread-safe. A ray that Embree cannot handle
/// (not finite, beyond kFarthest, without direction) hits nothing.
class EmbreeScene {
 public:
  EmbreeScene() = default;  ///< empty
  /// Copies the triangles. If there are `holes`, their scene must outlive this structure and all
  /// its copies. Throws Cancelled, or Error if memory runs out.
  EmbreeScene(const EmbreeDevice& device, std::span<const Vec3f> vertices,
              std::span<const std::array<uint32_t, 3>> triangles, Progress* progress,
              const std::optional<Holes>& holes = {});

  explicit operator bool() const { return scene_ != nullptr; }
  Hit closest(uint32_t first_primitive, Vec3f o, Vec3f d, float from, float to) const;
  bool occluded(Vec3f o, Vec3f d, float to) const;
  /// The share of light along the ray that passes what it meets before `to`: the product over
  /// surfaces, in their order along the ray. Only of rays that are not occluded.
  float transmittance(Vec3f o, Vec3f d, float to) const;
  /// A triangle that blocks the ray, and all others that meet it: none of its points lets rays
  /// pass. Null if the ray is free, or meets another triangle first.
  std::optional<Corners> blocker(Vec3f o, Vec3f d, float to) const;
  /// Which of the rays in `wanted` are blocked.
  RayBits occluded(const RayFan& fan, const RayBits& wanted) const;
  /// All intersections of the ray, holes aside, one per triangle, in no order; as many as `out` has
  /// room for.
  size_t intersections(Vec3f o, Vec3f d, std::span<Intersection> out) const;

 private:
  std::shared_ptr<const Holes> holes_;  // null if there are none
  std::shared_ptr<void> scene_;
};

}  // namespace deltalux::trace
