// SPDX-License-Identifier: Apache-2.0
// Finds the gather rays and chains whose footprint a change touches: all others meet what they met.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "gather/hits/gather_hits.h"
#include "trace/change.h"

namespace deltalux::gather {

/// What the constructor takes must outlive it.
class StaleRays {
 public:
  /// `context`: of the scene after the change.
  StaleRays(const GatherHits& hits, const Context& context, const Change& change);

  /// Whether the change misses all segments but the last of chains within this box, and the shadow
  /// rays at their vertices.
  bool passes_by(const Box& chains) const;

  /// Sets again[ray] = 1 if what the ray met may have changed, or if something may be in its way
  /// now. `apart`: the result of passes_by() for the sample's chains, or for more.
  void mark(const SampleRays& rays, size_t sample, bool apart, std::vector<uint8_t>& again) const;

 private:
  /// Finds the cells from which the change may hide a beam's lamp, or hid it before.
  void shade_beams();
  /// Whether a ray that depends on beams does so by something that the change may have shaded.
  bool shaded(uint32_t target) const;
  bool touches_beams(const Box& points) const;
  /// Whether what moved may lie in the way to what a ray met before: the first hit of a chain is
  /// within its footprint, where a cell is it would take as long to tell as to test the ray.
  bool may_be_hidden(uint32_t target) const;
  /// Whether what a ray met may have changed.
  bool gone(uint32_t target, bool apart) const;
  /// Whether the cell is one of an object that was moved.
  bool is_own(uint32_t cell) const;
  /// Collects the shapes of the lights that changed.
  void find_changed_lights();
  /// Whether one of them may give something, or gave, to a point of the box, so that others are
  /// asked there with other chances.
  bool lit_by_changed(const Box& points) const;
  /// Whether the change may affect the chain.
  bool touches(uint32_t chain, bool apart) const;

  const GatherHits& hits_;
  const Context& context_;
  const Change& change_;
  trace::ChangeTest test_;
  std::vector<std::pair<uint32_t, uint32_t>> own_;  // cell ranges of the changed objects
  bool suns_;                // whether one of the suns that are asked at hits changed
  direct::Shapes changed_;   // of the lights that changed, before and after
  bool everywhere_ = false;  // whether these may matter anywhere
  bool same_lamps_ = false;  // whether no light changed, and none is asked at the ends of chains
  uint64_t placed_;          // one bit per beam: its lamp changed
  std::vector<uint8_t> shaded_;  // by cell, see shade_beams(); empty if none is
};

}  // namespace deltalux::gather
