// SPDX-License-Identifier: Apache-2.0
// What edits change of what rays meet and lights send, and whether that touches what an answer
// depends on.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/shadow_volume.h"

namespace deltalux::trace {

/// A movable that was moved, added or removed. Boxes are those of RayCaster::object_bounds(), and
/// parts of part_bounds().
struct MovedObject {
  uint32_t object;
  std::vector<Box> passed;  ///< bounds before and after the move
  Box now;                  ///< empty if the object is absent now
  /// Of all that it passed, and where it is now; empty if not known.
  std::vector<Box> parts{}, parts_now{};
};

/// The difference between two states of the scene.
struct Change {
  std::vector<MovedObject> objects;
  /// By light: 1 if what it sends differs, since it was moved, turned, switched or added.
  std::vector<uint8_t> lights;
  /// What those lights were before, in any order, with all states in between; if these are more
  /// than kMaxBefore, not all.
  std::vector<Light> before{};
  static constexpr size_t kMaxBefore = 64;

  bool changes(uint32_t light) const { return light < lights.size() && lights[light]; }
  bool changes_lights() const;
  bool empty() const { return objects.empty() && !changes_lights(); }
  /// Adds a later change.
  void merge(const Change& later);
};

/// Whether the way between two points meets one of the boxes.
bool meets_any(std::span<const Box> boxes, Vec3f from, Vec3f to);

/// Decides whether a change touches what answers depend on. True wherever the answer differs;
/// elsewhere seldom.
class ChangeTest {
 public:
  /// `lights`: those of the scene, after the change.
  ChangeTest(const Change& change, std::span<const Light> lights, float slack);

  const Change& change() const { return change_; }
  /// Whether the object was moved, added or removed.
  bool moves(uint32_t object) const;
  /// Whether something that moved is in this space, or was.
  bool touches(const Box& space) const;
  /// Whether something that moved is between these points, or was.
  bool touches(Vec3f from, Vec3f to) const;
  /// The boxes that something moved out of or into.
  std::span<const Box> boxes() const { return boxes_; }
  /// Whether what moved may hide this light from these points, or hid it.
  bool shades(uint32_t light, const Box& points) const;
  bool shades(uint32_t light, Vec3f point) const;
  /// Whether the direct light at these points of this light may differ: the light, or its shadows.
  bool touches_light(uint32_t light, const Box& points) const;
  bool touches_light(uint32_t light, Vec3f point) const;
  /// What the boxes may hide, or hid, of this light.
  std::span<const ShadowVolume> shadows_of(uint32_t light) const {
    return std::span(shadows_).subspan(light * boxes_.size(), boxes_.size());
  }

 private:
  /// Whether `meets` holds for one of the light's shadows, and likewise for one of a part.
  template <class Meets>
  bool shadows_meet(uint32_t light, const Meets& meets) const;

  const Change& change_;
  std::vector<Box> boxes_;             // that something moved out of or into
  std::vector<ShadowVolume> shadows_;  // by light and box
  std::vector<Box> parts_;             // of these boxes, holding less; empty if there are no more
  std::vector<ShadowVolume> parts_shadows_;  // by light and part; empty if these would be many
};

}  // namespace deltalux::trace
