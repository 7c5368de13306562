// SPDX-License-Identifier: Apache-2.0
// The paths of a sun start on a rectangle as large as the scene's first box. Beyond it, an object
// would get no light of these paths, and the scene none that it reflects.
#include "session/flow/reach.h"

#include "trace/lights.h"

namespace deltalux::session {
namespace {

constexpr const char* kRemedy = "; move it inside, or start a new session with it there";

/// Whether all lines along the sun's direction through the box begin on its rectangle.
bool is_lit_by(const lights::Punctual& sun, const Box& box) {
  bool all = true;
  for (int i = 0; i < 8; ++i) {
    const Vec3f d = Vec3f{i & 1 ? box.high.x : box.low.x, i & 2 ? box.high.y : box.low.y,
                          i & 4 ? box.high.z : box.low.z} -
                    sun.corner;
    for (const Vec3f side : {sun.frame_u, sun.frame_v})
      all = all && dot(d, side) >= 0 && dot(d, side) <= dot(side, side);
  }
  return all;
}

}  // namespace

Reach::Reach(const State& s) : first_(s.scene.first_world()), shared_(!s.holds_all()) {
  for (const trace::Light& light : s.lights) {
    if (!light.is_parallel()) continue;
    if (light.object == scene::kNone)
      suns_.push_back(light.punctual);
    else
      turning_suns_ = true;
  }
}

std::string Reach::refusal(const Box& bounds) const {
  constexpr Vec3f kFar{kFarthest, kFarthest, kFarthest};
  if (first_.contains(bounds)) return {};
  if (!Box{-kFar, kFar}.contains(bounds))
    return "would lie beyond 1e15 m; move it nearer to the middle of the scene";
  if (shared_)
    return std::string(
               "would leave the box that the session was baked for (the scene's bounds), "
               "and other sessions hold some of its paths") +
           kRemedy;
  for (const lights::Punctual& sun : suns_)
    if (!is_lit_by(sun, bounds))
      return std::string(
                 "would leave the box that the session was baked for (the scene's bounds), "
                 "where paths of the sun begin") +
             kRemedy;
  if (turning_suns_)
    return std::string(
               "would leave the box that the session was baked for (the scene's bounds), "
               "where paths of suns begin that objects carry") +
           kRemedy;
  return {};
}

}  // namespace deltalux::session
