// SPDX-License-Identifier: Apache-2.0
// Blocks of receivers: the unit of parallel work, and of culling by shadow volumes.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "direct/light_shape.h"
#include "trace/ray_caster.h"
#include "trace/shadow_volume.h"

namespace deltalux::direct {

inline constexpr size_t kBlock = 256;

constexpr size_t block_count(size_t receivers) { return (receivers + kBlock - 1) / kBlock; }

/// Points of up to kBlock receivers as a structure of arrays.
struct ReceiverBlock {
  ReceiverBlock(std::span<const Receiver> receivers, size_t first, size_t last)
      : begin(first), end(last), count(last - first) {
    for (size_t i = 0; i < count; ++i) {
      const Vec3f p = receivers[begin + i].point;
      x[i] = p.x, y[i] = p.y, z[i] = p.z;
      bounds.grow(p);
    }
  }

  size_t begin, end, count;
  Box bounds;
  alignas(64) float x[kBlock], y[kBlock], z[kBlock];
};

/// The movable objects that may block light between one light and the receivers of a block.
class Blockers {
 public:
  Blockers(const trace::RayCaster& caster, const trace::Light& light, const ReceiverBlock& block) {
    for (uint32_t object : caster.present()) {
      const trace::ShadowVolume volume(light, caster.object_bounds(object),
                                       trace::shadow_slack(caster));
      if (!volume.misses(block.bounds)) near_.push_back({object, volume});
    }
  }
  /// The objects that may hide a part of the light from `receiver`. Leaves out the receiver's own
  /// object, whose occlusion is part of FixedView. The result is valid until the next call.
  std::span<const uint32_t> of(const Receiver& receiver) {
    found_.clear();
    for (const Near& n : near_)
      if (n.object != receiver.object && n.volume.contains(receiver.point))
        found_.push_back(n.object);
    return found_;
  }

 private:
  struct Near {
    uint32_t object;
    trace::ShadowVolume volume;
  };
  std::vector<Near> near_;
  std::vector<uint32_t> found_;
};

}  // namespace deltalux::direct
