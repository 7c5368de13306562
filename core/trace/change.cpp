// SPDX-License-Identifier: Apache-2.0
// Tests what answers depend on against the boxes of what moved, and their shadows.
#include "trace/change.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace deltalux::trace {
namespace {

constexpr size_t kMaxPassed = 6;          // boxes kept per object; more are merged
constexpr size_t kMaxPartShadows = 4096;  // for more, shadows of whole boxes do

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
    same->parts.insert(same->parts.end(), moved.parts.begin(), moved.parts.end());
    same->parts_now = moved.parts_now;
    if (same->passed.size() <= kMaxPassed) continue;
    Box all;
    for (const Box& box : same->passed) all.grow(box);
    same->passed = same->parts = {all};
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
  for (const MovedObject& moved : change.objects) {
    boxes_.insert(boxes_.end(), moved.passed.begin(), moved.passed.end());
    const std::vector<Box>& parts = moved.parts.empty() ? moved.passed : moved.parts;
    parts_.insert(parts_.end(), parts.begin(), parts.end());
  }
  if (parts_.size() == boxes_.size()) parts_.clear();
  for (const Light& light : lights)
    for (const Box& box : boxes_) shadows_.emplace_back(light, box, slack);
  if (lights.size() * parts_.size() > kMaxPartShadows) return;
  for (const Light& light : lights)
    for (const Box& part : parts_) parts_shadows_.emplace_back(light, part, slack);
}

bool ChangeTest::moves(uint32_t object) const {
  return std::any_of(change_.objects.begin(), change_.objects.end(),
                     [&](const MovedObject& moved) { return moved.object == object; });
}

bool ChangeTest::touches(const Box& space) const {
  const auto overlaps = [&](const Box& box) { return box.overlaps(space); };
  return std::any_of(boxes_.begin(), boxes_.end(), overlaps) &&
         (parts_.empty() || std::any_of(parts_.begin(), parts_.end(), overlaps));
}

bool ChangeTest::touches(Vec3f from, Vec3f to) const {
  return meets_any(boxes_, from, to) && (parts_.empty() || meets_any(parts_, from, to));
}

template <class Meets>
bool ChangeTest::shadows_meet(uint32_t light, const Meets& meets) const {
  const auto shadows = shadows_of(light);
  if (std::none_of(shadows.begin(), shadows.end(), meets)) return false;
  if (parts_shadows_.empty()) return true;
  const auto parts = std::span(parts_shadows_).subspan(light * parts_.size(), parts_.size());
  return std::any_of(parts.begin(), parts.end(), meets);
}

bool ChangeTest::shades(uint32_t light, const Box& points) const {
  return shadows_meet(light, [&](const ShadowVolume& shadow) { return !shadow.misses(points); });
}

bool ChangeTest::shades(uint32_t light, Vec3f point) const {
  return shadows_meet(light, [&](const ShadowVolume& shadow) { return shadow.contains(point); });
}

bool ChangeTest::touches_light(uint32_t light, const Box& points) const {
  return change_.changes(light) || shades(light, points);
}

bool ChangeTest::touches_light(uint32_t light, Vec3f point) const {
  return change_.changes(light) || shades(light, point);
}

}  // namespace deltalux::trace
