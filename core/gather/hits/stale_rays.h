// SPDX-License-Identifier: Apache-2.0
// Finds the gather rays and chains whose footprint a change touches: all others meet what they met.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "gather/hits/gather_hits.h"
#include "trace/change.h"
#include "trace/ways.h"

namespace deltalux::gather {

/// What an update does about a ray.
struct Stale {
  enum What : uint8_t {
    no,      ///< nothing
    lights,  ///< its chain asks lights again
    tail,    ///< the same at its first vertices, and it is cast again behind them
    all      ///< it is cast again
  } what = no;
  uint8_t kept = 0;  ///< the number of these vertices
};

/// What the constructor takes must outlive it.
class StaleRays {
 public:
  /// `context`: of the scene after the change.
  StaleRays(const GatherHits& hits, const Context& context, const Change& change);

  /// What the change leaves of chains whose segments but the last are within a box.
  struct Around {
    /// Whether the change misses these segments, and all shadow rays at their vertices.
    bool apart;
    /// For all of them, where a last segment starts, and what it would have to miss from there.
    Vec3f from;
    std::vector<Box> wider;
  };
  Around around(const Box& chains) const;

  /// Memory of mark(), which a thread uses again for its next sample.
  struct Scratch {
    std::vector<uint32_t> chained, passing;  ///< rays: with a chain; that may be hidden now
    trace::Ways tips, landings;              ///< where the chains end, and where those rays land
  };
  /// Sets again[ray] to what to do about what the ray met. `around`: of the sample's chains, or of
  /// more.
  void mark(const SampleRays& rays, size_t sample, const Around& around, Scratch& scratch,
            std::vector<Stale>& again) const;
  /// Why a vertex of a chain asks again that is not cast again there.
  Renewal renewal(const Vertex& vertex, const direct::Receiver& at) const;

 private:
  /// Finds what to do about rays that meet a cell.
  void judge_cells();
  /// Does what mark() does, for the rays with a chain, but for those towards points that moved.
  void mark_chains(const SampleRays& rays, size_t sample, const Around& around, Scratch& scratch,
                   std::vector<Stale>& again) const;
  /// Whether something that moved is now before the first hit of a chain. `apart`: see Around.
  bool is_hidden(const SampleRays& rays, uint32_t ray, uint32_t chain, bool apart) const;
  /// Whether a ray meets the object now, wherever it lands.
  bool meets(const SampleRays& rays, uint32_t ray, const trace::MovedObject& moved) const;
  /// Marks rays without a chain that are hidden by a moved object now.
  void mark_hidden(const SampleRays& rays, size_t sample, const trace::MovedObject& moved,
                   Scratch& scratch, std::vector<Stale>& again) const;
  /// Whether the change may have shaded a point between a chain's segments from a beam.
  bool bends_shaded(uint32_t chain) const;
  bool touches_beams(const Box& points) const;
  /// What to do about a chain, if nothing new hides its first hit, and if beams still shine where
  /// it depends on them.
  Stale gone(uint32_t chain, bool in_beam, const Around& around) const;
  /// Of a chain that goes on behind its first hit: what the change may touch there.
  Stale touched(uint32_t chain, const Around& around) const;
  /// Whether the cell is one of an object that was moved.
  bool is_own(uint32_t cell) const;
  /// Collects the shapes of the lights that changed.
  void find_changed_lights();
  /// Whether one of them may give something, or gave, to a point of the box.
  bool lit_by_changed(const Box& points) const;

  const GatherHits& hits_;
  const Context& context_;
  const Change& change_;
  trace::ChangeTest test_;
  std::vector<std::pair<uint32_t, uint32_t>> own_;  // cell ranges of the changed objects
  bool suns_;                // whether one of the suns that are asked at hits changed
  bool keeps_ways_;          // whether chains can ask lights again without being cast again
  direct::Shapes changed_;   // of the lights that changed, before and after
  bool everywhere_ = false;  // whether these may matter anywhere
  uint64_t placed_;          // one bit per beam: its lamp changed
  std::vector<BodyCells::Ball> landing_;  // by cell, see each_landing(); empty if nothing moved
  /// Which rays that meet a cell are cast again.
  enum Met : uint8_t { none, in_beams, all };
  std::vector<Met> met_;  // by cell, and for what is none
};

}  // namespace deltalux::gather
