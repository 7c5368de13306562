// SPDX-License-Identifier: Apache-2.0
// A small room with a lamp and a movable box, samples in it, and options: for tests of sessions.
#pragma once
#include "direct_world.h"
#include "lights/kinds.h"
#include "mirror.h"
#include "pane.h"
#include "session/session.h"

namespace deltalux::session {

/// A room of 4 x 3 x 4 m with a lamp under the ceiling and a movable box.
inline scene::Scene room() {
  scene::Scene scene;
  scene.materials = {{{0.7f, 0.6f, 0.5f}, {}, false}, {{}, {10, 8, 6}, false}};
  scene::Object walls, block;
  walls.name = "walls";
  direct::add_box(walls, {4, 3, 4}, {0, 0, 0});  // turned inside out
  direct::add_quad(walls, {1.5f, 2.9f, 1.5f}, {1, 0, 0}, {0, 0, 1}, 1);
  block.name = "block";
  block.movable = true;
  direct::add_box(block, {-0.3f, -0.3f, -0.3f}, {0.3f, 0.3f, 0.3f});
  block.pose.translation = {1, 0.5, 1};
  scene.objects = {walls, block};
  scene.finish();
  return scene;
}

/// The room with a narrow spot above the box, which sessions that gather send rays after.
inline scene::Scene room_with_spot() {
  scene::Scene scene = room();
  scene::PunctualLight spot{};
  spot.kind = &lights::kind_named("spot");
  spot.position = {2, 2.8f, 2};
  spot.direction = {0.1f, -1, 0.05f};
  spot.intensity = {4000, 3000, 2000};
  spot.parameters = {0.001f, 0.003f};
  scene.lights = {spot};
  scene.finish();
  return scene;
}

/// The room with a spot, a mirror on a wall, and a block that mirrors half of what it reflects.
inline scene::Scene room_with_mirrors() {
  scene::Scene scene = room_with_spot();
  scene.materials.push_back(surfaces::mirror({0.9f, 0.8f, 0.7f}));
  scene.materials.push_back(surfaces::mirror({0.6f, 0.6f, 0.8f}, 0.5f));
  direct::add_quad(scene.objects[0], {0.01f, 0.4f, 1}, {0, 2, 0}, {0, 0, 2}, 2);
  for (uint32_t& own : scene.objects[1].material) own = 3;
  scene.finish();
  return scene;
}

/// The room with a spot, a pane from wall to wall of this transmittance, and a movable one that
/// lies above the block.
inline scene::Scene room_with_panes(float passes = 0.8f) {
  scene::Scene scene = room_with_spot();
  scene.materials.push_back(surfaces::dimming_pane(passes));
  scene.materials.push_back(surfaces::dimming_pane(0.5f));
  direct::add_quad(scene.objects[0], {2.9f, 0, 0}, {0, 3, 0}, {0, 0, 4}, 2);
  scene::Object lid;
  lid.name = "lid";
  lid.movable = true;
  direct::add_quad(lid, {-0.6f, 0, -0.6f}, {1.2f, 0, 0}, {0, 0, 1.2f}, 3);
  lid.pose.translation = {1.2, 1.6, 1.4};
  scene.objects.push_back(lid);
  scene.finish();
  return scene;
}

inline samples::SampleSet some_samples() {
  samples::SampleSet set;
  for (int i = 0; i < 64; ++i) {
    set.point.push_back({0.25f + 0.5f * float(i % 8), 0, 0.25f + 0.5f * float(i / 8)});
    set.normal.push_back({0, 1, 0});
    set.attached.push_back(scene::kNone);
  }
  for (int i = 0; i < 4; ++i) {
    set.point.push_back({-0.2f + 0.1f * float(i), 0.3f, 0});
    set.normal.push_back({0, 1, 0});
    set.attached.push_back(1);
  }
  set.radius.assign(set.point.size(), 0.2f);
  return set;
}

inline Options options(int threads, DirectMode direct, segments::SegmentEnd end) {
  Options out;
  out.paths = 4000;
  out.threads = threads;
  out.direct = direct;
  out.segment_end = end;
  return out;
}

inline Options gathering(int threads) {
  Options out = options(threads, DirectMode::automatic, segments::SegmentEnd::first);
  out.gather_rays = 64;
  return out;
}

inline Pose at(double x, double z) {
  Pose pose;
  pose.translation = {x, 0.5, z};
  return pose;
}

/// A lamp of its own that can be added.
inline scene::Object second_lamp() {
  scene::Object lamp;
  lamp.name = "second lamp";
  lamp.movable = true;
  direct::add_quad(lamp, {-0.2f, 0, -0.2f}, {0.4f, 0, 0}, {0, 0, 0.4f}, 1);
  lamp.pose.translation = {3, 2, 3};
  return lamp;
}

/// The same, with a light group that the room does not have.
inline scene::Object lamp_of_a_new_group() {
  scene::Object lamp = second_lamp();
  lamp.group.assign(lamp.group.size(), 1);
  return lamp;
}

}  // namespace deltalux::session
