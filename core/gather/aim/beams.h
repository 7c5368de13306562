// SPDX-License-Identifier: Apache-2.0
// The narrow spots that have guides. Gather rays compute their direct light by shadow rays; it is
// never averaged over a cell.
#pragma once
#include <span>
#include <vector>

#include "gather/aim/beam.h"
#include "gather/cells/cells.h"
#include "trace/change.h"

namespace deltalux::gather {

inline constexpr uint32_t kMaxBeams = 64;

/// All beams of the scene. A pure function of the guides and of the present scene.
class Beams {
 public:
  Beams() = default;
  Beams(std::span<const BeamGuide> guides, const scene::Scene& scene,
        std::span<const trace::Light> lights, const trace::RayCaster& caster, const Cells& cells,
        uint64_t seed);
  /// Updates the beams after an edit. Returns 1 for each point that differs, by beam and point;
  /// empty if none does.
  std::vector<uint8_t> update(const scene::Scene& scene, std::span<const trace::Light> lights,
                              const trace::RayCaster& caster, const Cells& cells,
                              const trace::Change& change);

  size_t size() const { return beams_.size(); }
  size_t bytes() const {
    return beams_.size() * (sizeof(Beam) + Beam::kPoints * sizeof(Beam::Point)) +
           reach_.capacity() * sizeof(uint64_t);
  }
  const Beam& operator[](size_t beam) const { return beams_[beam]; }
  /// Whether gather rays compute this light as a beam.
  bool has(uint32_t light) const { return light < lights_.size() && lights_[light]; }
  /// One bit per beam whose lamp was moved or switched.
  uint64_t placed(const trace::Change& change) const;
  /// The maximum of Beam::beside over all beams.
  float beside(Vec3f place) const;
  /// One bit per beam whose light may reach the cell, if nothing is in between.
  uint64_t reach(uint32_t cell) const { return reach_.empty() ? 0 : reach_[cell]; }

 private:
  void find_reach(const scene::Scene& scene, const Cells& cells, std::span<const uint32_t> objects);

  uint64_t seed_ = 0;
  std::vector<Beam> beams_;
  std::vector<uint8_t> lights_;  // by light, up to the last one with a beam: 1 if it has one
  std::vector<uint64_t> reach_;  // by cell; empty without beams
};

}  // namespace deltalux::gather
