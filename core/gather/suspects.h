// SPDX-License-Identifier: Apache-2.0
// Finds the gather rays and chains that an edit may affect: all others met what they meet now.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "direct/shadow_volume.h"
#include "gather/looks.h"

namespace deltalux::gather {

/// What a change may affect. `looks` and what else the constructor takes must outlive it.
class Suspects {
 public:
  /// `present`: the scene after the change.
  Suspects(const Looks& looks, const Present& present, const Change& change);

  /// Whether the change misses all segments but the last of these chains, and the shadow rays at
  /// their vertices.
  bool passes_by(std::span<const uint32_t> targets) const;

  /// Sets again[ray] = 1 if what the ray met may have changed, or if something may be in its way
  /// now. `apart`: the result of passes_by() for these targets, or for more.
  void mark(const SampleRays& rays, size_t sample, bool apart, std::vector<uint8_t>& again) const;

 private:
  /// Finds the cells from which the change may hide a beam's lamp, or hid it before.
  void shade_beams(float slack);
  /// Whether a ray that depends on beams does so by something that the change may have shaded.
  bool shaded(uint32_t target) const;
  bool misses_beams(const Box& points) const;
  /// Whether what a ray met may have changed.
  bool gone(uint32_t target, bool apart) const;
  /// Whether the cell is one of an object that was moved.
  bool is_own(uint32_t cell) const;
  /// Whether the change may affect the chain.
  bool touches(uint32_t chain, bool apart) const;
  /// Whether the light at a chain's end is that of a sun which the change may hide now, or may have
  /// hidden before.
  bool shines(const Vertex& vertex, Vec3f end) const;
  std::span<const direct::ShadowVolume> shadows_of(uint32_t light) const {
    return std::span(shadows_).subspan(light * boxes_.size(), boxes_.size());
  }

  const Looks& looks_;
  const Present& present_;
  const Change& change_;
  std::vector<std::pair<uint32_t, uint32_t>> own_;  // cell ranges of the changed objects
  std::vector<Box> boxes_;
  std::vector<direct::ShadowVolume> shadows_;  // by light and box
  // If something moved within a beam, and no beam's lamp did:
  std::vector<direct::ShadowVolume> beam_shadows_;  // of the beams that the boxes meet
  std::vector<uint8_t> shaded_;                     // by cell, see shade_beams()
};

}  // namespace deltalux::gather
