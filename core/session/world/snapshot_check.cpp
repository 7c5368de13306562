// SPDX-License-Identifier: Apache-2.0
// Checks of a session file's contents. A file with correct checksums may still be hostile: nothing
// in it may lead to an access outside of an array, an endless loop or a NaN.
#include "session/world/snapshot_check.h"

#include <cmath>
#include <numbers>
#include <sstream>

#include "base/error.h"

namespace deltalux::session::snapshot {

void refuse(const std::string& what) {
  throw FormatError("session file: " + what + "; the file is damaged or was not written by save");
}

void refuse_entry(const char* name, size_t entry, double found, double low, double high) {
  std::ostringstream text;
  text << '"' << name << "\": found " << found << " at entry " << entry << ", expected " << low
       << " to " << high;
  refuse(text.str());
}

void check_quantum(const char* name, double found, double chosen) {
  constexpr double kMinQuantum = 1e-200, kSlack = 0x1p20;
  // The quantum of a session that began without lights is 1.
  const double most = std::max(1.0, kSlack * chosen);
  if (!(found >= kMinQuantum && found <= most)) refuse_entry(name, 0, found, kMinQuantum, most);
}

void check_poses(const std::vector<scene::Object>& original, const scene::Scene& scene) {
  for (uint32_t i = 0; i < scene.objects.size(); ++i) {
    const scene::Object& object = scene.objects[i];
    const Pose& pose = object.pose;
    if (object.present == original[i].present && pose == original[i].pose) continue;
    if (!object.movable) refuse("\"" + object.name + "\" is static, but was moved or removed");
    bool rigid = dot(cross(pose.row[0], pose.row[1]), pose.row[2]) > 0;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        rigid = rigid && std::fabs(dot(pose.row[r], pose.row[c]) - double(r == c)) < 1e-3;
    constexpr Vec3f kFar{kFarthest, kFarthest, kFarthest};
    if (!rigid || !Box{-kFar, kFar}.contains(scene.bounds_at(i, pose)))
      refuse("\"" + object.name + "\" has no rigid pose within 1e15 m");
  }
}

void check_radii(std::span<const float> radius, std::span<const float> given, const Box& world,
                 bool known) {
  const float most = world.diagonal();
  for (size_t i = 0; i < radius.size(); ++i) {
    const float r = radius[i];
    const bool automatic = std::isnan(given[i]);
    const bool sound =
        automatic ? (r > 0 && r <= most) || (std::isnan(r) && !known) : r == given[i];
    if (!sound) refuse_entry("radius", i, r, automatic ? 0 : given[i], automatic ? most : given[i]);
  }
}

void check_areas(std::span<const float> area, std::span<const float> radius,
                 std::span<const float> openness) {
  // Wider than the bounds that any DiscArea option allows.
  constexpr double kMinShare = 1e-4, kMaxShare = 2;
  for (size_t i = 0; i < area.size(); ++i) {
    if (area[i] == 0) continue;
    const double counted = std::numbers::pi * double(radius[i]) * double(radius[i]) /
                           (openness.empty() ? 1.0 : double(openness[i]));
    const double least = kMinShare * counted, most = kMaxShare * counted;
    // The area may have overflowed single precision.
    const bool fits = double(area[i]) <= most || most > double(std::numeric_limits<float>::max());
    if (!(double(area[i]) >= least && fits)) refuse_entry("area", i, double(area[i]), least, most);
  }
}

void check_sums(std::span<const int64_t> sums, size_t segments) {
  const double most = 0x1p31 * double(segments);
  for (size_t i = 0; i < sums.size(); ++i)
    if (sums[i] < 0 || double(sums[i]) > most) refuse_entry("sums", i, double(sums[i]), 0, most);
}

}  // namespace deltalux::session::snapshot
