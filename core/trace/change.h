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

/// A movable that was moved, added or removed. Boxes are those of RayCaster::object_bounds().
struct MovedObject {
  uint32_t object;
  std::vector<Box> passed;  ///< bounds before and after the move
  Box now;                  ///< empty if the object is absent now
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

/// What the answer of a query that cast several rays, one after the other, depends on: whatever is
/// on these rays, and the lights that it asked for.
struct Footprint {
  /// Bounds of all segments but the last, and of the points between them, from which lights were
  /// asked.
  Box near;
  /// The last segment: where it starts and ends. Where it hits nothing, it ends far outside of the
  /// world.
  Vec3f from, to;
};

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
  /// Whether the direct light at these points of this light may differ.
  bool touches_light(uint32_t light, const Box& points) const;
  bool touches_light(uint32_t light, Vec3f point) const;
  /// Whether the answer may differ of a query that asked for the lights in asked(visit), which
  /// calls visit(light, whether at the end of the last segment or before).
  template <class Asked>
  bool touches(const Footprint& own, const Asked& asked) const {
    if (touches(own.from, own.to) || touches(own.near)) return true;
    bool found = false;
    asked([&](uint32_t light, bool at_end) {
      found = found || (at_end ? touches_light(light, own.to) : touches_light(light, own.near));
    });
    return found;
  }

 private:
  std::span<const ShadowVolume> shadows_of(uint32_t light) const {
    return std::span(shadows_).subspan(light * boxes_.size(), boxes_.size());
  }

  const Change& change_;
  std::vector<Box> boxes_;             // that something moved out of or into
  std::vector<ShadowVolume> shadows_;  // by light and box
};

}  // namespace deltalux::trace
