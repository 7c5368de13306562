// SPDX-License-Identifier: Apache-2.0
// The narrow spots that have guides. Gather rays compute their direct light by shadow rays; it is
// never averaged over a cell.
#pragma once
#include <span>
#include <vector>

#include "gather/beam.h"
#include "gather/cells.h"

namespace deltalux::gather {

inline constexpr uint32_t kMaxBeams = 64;

/// How an edit changed the beams.
struct BeamChange {
  bool touched = false;         ///< whether something moved within a beam
  uint64_t placed = 0;          ///< one bit per beam: its lamp was moved or switched
  std::vector<uint8_t> points;  ///< by beam and point: 1 if the point differs
  /// Adds a later change.
  void merge(const BeamChange& later);
};

/// All beams of the scene. A pure function of the guides and of the present scene.
class Beams {
 public:
  Beams() = default;
  Beams(std::span<const BeamGuide> guides, const scene::Scene& scene,
        std::span<const trace::Light> lights, const trace::RayCaster& caster, const Cells& cells,
        uint64_t seed);
  /// Updates the beams after an edit: `objects` were moved, added or removed; `boxes` are their
  /// bounds before and after.
  BeamChange update(const scene::Scene& scene, std::span<const trace::Light> lights,
                    const trace::RayCaster& caster, const Cells& cells,
                    std::span<const uint32_t> objects, std::span<const Box> boxes);

  size_t size() const { return beams_.size(); }
  size_t bytes() const {
    return beams_.size() * (sizeof(Beam) + Beam::kPoints * sizeof(Beam::Point)) +
           reach_.capacity() * sizeof(uint64_t);
  }
  const Beam& operator[](size_t beam) const { return beams_[beam]; }
  /// Whether gather rays compute this light as a beam.
  bool has(uint32_t light) const { return light < lights_.size() && lights_[light]; }
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
