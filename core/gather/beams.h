// SPDX-License-Identifier: Apache-2.0
// The narrow spots that have guides: their light is asked for where a ray lands, never averaged
// over a cell.
#pragma once
#include <span>
#include <vector>

#include "gather/beam.h"
#include "gather/cells.h"

namespace deltalux::gather {

inline constexpr uint32_t kMaxBeams = 64;

/// What an edit did to beams.
struct BeamChange {
  bool touched = false;         ///< something moved within one
  uint64_t placed = 0;          ///< a bit per beam: its lamp moved, or was switched
  std::vector<uint8_t> points;  ///< per beam and point: 1 = it differs
  void merge(const BeamChange& later);
};

/// A pure function of the guides and of the present scene.
class Beams {
 public:
  Beams() = default;
  Beams(std::span<const BeamGuide> guides, const scene::Scene& scene,
        std::span<const trace::Light> lights, const trace::RayCaster& caster, const Cells& cells,
        uint64_t seed);
  /// After edits: `objects` moved, came or went, through `boxes`.
  BeamChange update(const scene::Scene& scene, std::span<const trace::Light> lights,
                    const trace::RayCaster& caster, const Cells& cells,
                    std::span<const uint32_t> objects, std::span<const Box> boxes);

  size_t size() const { return beams_.size(); }
  size_t bytes() const {
    return beams_.size() * (sizeof(Beam) + Beam::kPoints * sizeof(Beam::Point)) +
           reach_.capacity() * sizeof(uint64_t);
  }
  const Beam& operator[](size_t beam) const { return beams_[beam]; }
  /// Whether the light has a beam.
  bool has(uint32_t light) const { return light < lights_.size() && lights_[light]; }
  /// Of the beam where it is most: see Beam::beside.
  float beside(Vec3f place) const;
  /// A bit per beam whose light may reach the cell, if nothing is between.
  uint64_t reach(uint32_t cell) const { return reach_.empty() ? 0 : reach_[cell]; }

 private:
  void find_reach(const scene::Scene& scene, const Cells& cells, std::span<const uint32_t> objects);

  uint64_t seed_ = 0;
  std::vector<Beam> beams_;
  std::vector<uint8_t> lights_;  // up to the last that has one: 1 = it does
  std::vector<uint64_t> reach_;  // per cell; empty without beams
};

}  // namespace deltalux::gather
