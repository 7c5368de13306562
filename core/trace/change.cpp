// SPDX-License-Identifier: Apache-2.0
// Tests what answers depend on against the boxes of what moved, and their shadows.
#include "trace/change.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace deltalux::trace {
namespace {

constexpr size_t kMaxPassed = 6;  // boxes kept per object; more are merged

}  // namespace

bool Change::changes_lights() const {
  return std::any_of(lights.begin(), lights.end(), std::identity{});
}

void Change::merge(const Change& later) {
  for (const MovedObject& moved : later.objects) {
    const auto same = std::find_if(objects.begin(), objects.end(), [&](const MovedObject& own) {
      return own.object == moved.object;
    });
    if (same == objects.end()) {
      objects.push_back(moved);
      continue;
    }
    same->passed.insert(same->passed.end(), moved.passed.begin(), moved.passed.end());
    same->now = moved.now;
    if (same->passed.size() <= kMaxPassed) continue;
    Box all;
    for (const Box& box : same->passed) all.grow(box);
    same->passed = {all};
  }
  lights.resize(std::max(lights.size(), later.lights.size()), 0);
  for (size_t i = 0; i < later.lights.size(); ++i) lights[i] |= later.lights[i];
  if (before.size() <= kMaxBefore)
    before.insert(before.end(), later.before.begin(), later.before.end());
}

bool meets_any(std::span<const Box> boxes, Vec3f from, Vec3f to) {
  const Box bounds{min(from, to), max(from, to)};
  return std::any_of(boxes.begin(), boxes.end(), [&](const Box& box) {
    return box.overlaps(bounds) &&  // spares most the divisions
           SlabRay(from, to - from).entry(box, 1) < std::numeric_limits<float>::infinity();
  });
}

ChangeTest::ChangeTest(const Change& change, std::span<const Light> lights, float slack)
    : change_(change) {
  for (const MovedObject& moved : change.objects)
    boxes_.insert(boxes_.end(), moved.passed.begin(), moved.passed.end());
  for (const Light& light : lights)
    for (const Box& box : boxes_) shadows_.emplace_back(light, box, slack);
}

bool ChangeTest::moves(uint32_t object) const {
  return std::any_of(change_.objects.begin(), change_.objects.end(),
                     [&](const MovedObject& moved) { return moved.object == object; });
}

bool ChangeTest::touches(const Box& space) const {
  return std::any_of(boxes_.begin(), boxes_.end(),
                     [&](const Box& box) { return box.overlaps(space); });
}

bool ChangeTest::touches(Vec3f from, Vec3f to) const { return meets_any(boxes_, from, to); }

bool ChangeTest::shades(uint32_t light, const Box& points) const {
  const auto shadows = shadows_of(light);
  return std::any_of(shadows.begin(), shadows.end(),
                     [&](const ShadowVolume& shadow) { return !shadow.misses(points); });
}

bool ChangeTest::shades(uint32_t light, Vec3f point) const {
  const auto shadows = shadows_of(light);
  return std::any_of(shadows.begin(), shadows.end(),
                     [&](const ShadowVolume& shadow) { return shadow.contains(point); });
}

bool ChangeTest::touches_light(uint32_t light, const Box& points) const {
  return change_.changes(light) || shades(light, points);
}

bool ChangeTest::touches_light(uint32_t light, Vec3f point) const {
  return change_.changes(light) || shades(light, point);
}

}  // namespace deltalux::trace
