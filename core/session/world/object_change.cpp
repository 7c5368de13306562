// SPDX-License-Identifier: Apache-2.0
// Lists what changed objects carry.
#include "session/world/object_change.h"

namespace deltalux::session {

std::vector<Box> boxes_of(std::span<const ObjectChange> changes) {
  std::vector<Box> boxes;
  for (const ObjectChange& change : changes)
    for (const Box& box : {change.before, change.after})
      if (!box.empty()) boxes.push_back(box);
  return boxes;
}

std::vector<uint32_t> moved_samples(const World& world, std::span<const ObjectChange> changes) {
  std::vector<uint8_t> moved(world.scene.objects.size());
  for (const ObjectChange& change : changes) moved[change.object] = 1;
  std::vector<uint32_t> out;
  for (uint32_t i = 0; i < world.samples.size(); ++i)
    if (const uint32_t object = world.samples.attached[i]; object != scene::kNone && moved[object])
      out.push_back(i);
  return out;
}

}  // namespace deltalux::session
