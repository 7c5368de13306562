// SPDX-License-Identifier: Apache-2.0
// Keeps the direct light of a place as long as no moved object can shadow it, before or after the
// move.
#include "session/images/kept_direct.h"

#include <algorithm>
#include <utility>

#include "base/random.h"

namespace deltalux::session {

uint64_t KeptDirect::key_of(const direct::Receiver& receiver, bool by_need) {
  return combine(receiver.key, by_need);
}

const Vec3d* KeptDirect::find(const direct::Receiver& receiver, bool by_need) const {
  const auto found = places_.find(key_of(receiver, by_need));
  if (found == places_.end() || !(found->second.receiver == receiver)) return nullptr;
  found->second.used = true;
  return &found->second.light;
}

void KeptDirect::keep(const direct::Receiver& receiver, bool by_need, Vec3d light) {
  places_.insert_or_assign(key_of(receiver, by_need), Kept{receiver, light});
}

void KeptDirect::follow_changes(std::span<const trace::Light> lights, std::span<const double> dim,
                                float slack) {
  if (!std::equal(dim.begin(), dim.end(), dim_.begin(), dim_.end())) places_.clear();
  dim_.assign(dim.begin(), dim.end());
  const trace::Change change = std::exchange(change_, {});
  if (change.empty()) return;
  const trace::ChangeTest test(change, lights, slack);
  const auto touched = [&](Vec3f point) {
    for (uint32_t light = 0; light < lights.size(); ++light)
      if (test.touches_light(light, point)) return true;
    return false;
  };
  std::erase_if(places_, [&](const auto& entry) {
    const Kept& kept = entry.second;
    if (!kept.used || touched(kept.receiver.point)) return true;
    kept.used = false;
    return false;
  });
}

size_t KeptDirect::bytes() const {
  // approximate size of a node of the hash table
  constexpr size_t kNode = 3 * sizeof(void*) + sizeof(uint64_t);
  return places_.size() * (sizeof(Kept) + kNode);
}

}  // namespace deltalux::session
