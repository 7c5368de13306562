// SPDX-License-Identifier: Apache-2.0
// A file with right checksums may still be hostile: nothing in it may lead outside an array, round
// in circles or into NaN.
#include "update/snapshot_check.h"

#include <cmath>
#include <sstream>

#include "base/error.h"

namespace deltalux::update::snapshot {

using segments::kNoSlot;
using segments::Level;
using segments::Segment;

void refuse(const std::string& what) {
  throw FormatError("session file: " + what + "; the file is damaged or was not written by save");
}

void refuse_entry(const char* name, size_t entry, double found, double low, double high) {
  std::ostringstream text;
  text << '"' << name << "\": found " << found << " at entry " << entry << ", expected " << low
       << " to " << high;
  refuse(text.str());
}

void check_poses(const std::vector<scene::Object>& original, const scene::Scene& scene) {
  for (uint32_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const Pose& pose = object.pose;
    if (object.present == original[i].present && pose == original[i].pose) continue;
    if (!object.movable) refuse("\"" + object.name + "\" is static, but was moved or removed");
    bool rigid = true;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        rigid = rigid && std::fabs(dot(pose.row[r], pose.row[c]) - double(r == c)) < 1e-3;
    if (!rigid || !scene.world().contains(scene.bounds_at(i, pose)))
      refuse("\"" + object.name + "\" has no rigid pose within the scene's bounds");
  }
}

namespace {

bool is_sound(const Segment& s, uint32_t bounce, uint32_t slot, const scene::Scene& scene,
              uint64_t paths) {
  const Vec3f o = s.origin;
  return s.path < paths && (bounce > 0 || s.path == slot) && std::isfinite(o.x + o.y + o.z) &&
         std::isfinite(s.length) &&
         (s.primitive == scene::kNone || s.primitive < scene.primitives());
}

}  // namespace

void check_segments(const segments::SegmentStore& store, const scene::Scene& scene,
                    uint64_t paths) {
  const std::vector<Level>& levels = store.levels();
  if (!levels.empty() && levels[0].size() != paths)
    refuse("bounce 0 has " + std::to_string(levels[0].size()) + " segments for " +
           std::to_string(paths) + " paths");
  for (uint32_t b = 0; b < levels.size(); ++b) {
    const bool last = b + 1 == levels.size();
    std::vector<bool> followed(last ? 0 : levels[b + 1].size());
    for (uint32_t slot = 0; slot < levels[b].size(); ++slot) {
      const Segment& s = levels[b].at(slot);
      if (b == 0 && s.path != slot) refuse("a first segment is not that of its path");
      if (s.length < 0) continue;
      const float reach = levels[b].extended_or_length(slot);
      if (!is_sound(s, b, slot, scene, paths) || !(reach >= s.length))
        refuse("a segment of bounce " + std::to_string(b) + " is not sound");
      if (s.next == kNoSlot) continue;
      if (s.next >= followed.size() || followed[s.next] || levels[b + 1].at(s.next).length < 0 ||
          levels[b + 1].at(s.next).path != s.path)
        refuse("a path is not one chain of segments");
      followed[s.next] = true;
    }
    for (uint32_t slot = 0; slot < followed.size(); ++slot)
      if (levels[b + 1].at(slot).length >= 0 && !followed[slot])
        refuse("a segment does not belong to the path before it");
  }
}

void check_pending(const std::vector<PendingPath>& pending, const std::vector<uint8_t>& cut,
                   const segments::SegmentStore& store) {
  std::vector<bool> waiting(cut.size());
  for (const PendingPath& p : pending) {
    if (p.path >= cut.size() || waiting[p.path] || cut[p.path] != p.bounce ||
        p.bounce >= store.levels().size() || p.slot >= store.levels()[p.bounce].size() ||
        store.levels()[p.bounce].at(p.slot).path != p.path)
      refuse("\"pending\" refers to a segment that is not there");
    waiting[p.path] = true;
  }
  for (size_t path = 0; path < cut.size(); ++path)
    if (cut[path] != kNotCut && !waiting[path]) refuse("\"cut\" marks a path that does not wait");
}

}  // namespace deltalux::update::snapshot
