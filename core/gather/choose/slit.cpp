// SPDX-License-Identifier: Apache-2.0
// Tests with a few rays whether a receiver lies in a slit.
#include "gather/choose/slit.h"

namespace deltalux::gather {
namespace {

constexpr uint32_t kRays = 32, kMaxFar = 4;

}  // namespace

SlitFinder::SlitFinder(const Context& context, uint64_t seed)
    : context_(context),
      finder_(context.scene, context.cells),
      directions_(kRays, seed ^ 0x736c697421212121ull) {}

bool SlitFinder::operator()(const direct::Receiver& receiver) const {
  if (receiver.object != scene::kNone || receiver.normal == Vec3f{}) return false;
  const Vec3f origin = receiver.point + receiver.normal * receiver.slack();
  uint32_t far = 0;
  for (uint32_t ray = 0; ray < kRays && far <= kMaxFar; ++ray) {
    const Vec3f w = directions_(receiver.key, ray, receiver.normal);
    const trace::Hit hit = context_.caster.closest_static(origin, w);
    const uint32_t cell = hit.valid() ? finder_.find(hit.primitive, origin, w, hit.t) : kNoCell;
    far += cell == kNoCell || hit.t >= context_.cells.near(cell);
  }
  return far <= kMaxFar;
}

}  // namespace deltalux::gather
