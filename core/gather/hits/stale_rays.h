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
    bool apart = true;
    /// For all of them, where a last segment starts, and what it would have to miss from there.
    Vec3f from{};
    std::vector<Box> wider{};
  };
  bool is_apart(const Box& chains) const;
  /// Sets what `around` tells; `apart`: if that is known.
  void look_around(const Box& chains, bool apart, Around& around) const;

  /// What mark() found; memory, which a thread uses again for its next sample.
  class Scratch {
   public:
    /// The rays that something is to be done about, in any order.
    std::span<uint32_t> stale() { return stale_; }
    Stale of(uint32_t ray) const { return again_[ray]; }

   private:
    friend class StaleRays;
    void clear(size_t rays) { again_.assign(rays, Stale{}), stale_.clear(); }
    bool casts(uint32_t ray) const { return again_[ray].what == Stale::all; }
    void mark(uint32_t ray, Stale what) {
      if (what.what == Stale::no || casts(ray)) return;
      if (again_[ray].what == Stale::no) stale_.push_back(ray);
      again_[ray] = what;
    }
    std::vector<Stale> again_;     // by ray
    std::vector<uint32_t> stale_;  // rays
    std::vector<uint32_t> which_;  // rays that are tested together
    trace::Ways ways_;             // of these
  };
  /// Finds what to do about a sample's rays. `around`: of the sample's chains, or of more.
  void mark(const SampleRays& rays, size_t sample, const Around& around, Scratch& scratch) const;
  /// Why a vertex of a chain asks again that is not cast again there.
  Renewal renewal(const Vertex& vertex, const direct::Receiver& at) const;

 private:
  using Ball = BodyCells::Ball;
  /// Finds the cells where what moved may shade beams, or did.
  void find_shaded_beams();
  /// Finds the balls that hold all that moved, and its shadows.
  void find_balls();
  /// Marks rays that depend on beams of lamps that changed.
  void mark_placed(size_t sample, Scratch& scratch) const;
  /// Marks rays that depend on beams which may be shaded where they land, or were.
  void mark_in_beams(size_t sample, const Around& around, Scratch& scratch) const;
  /// Marks rays whose chains go on behind their first hit.
  void mark_bent(const SampleRays& rays, size_t sample, const Around& around,
                 Scratch& scratch) const;
  /// Of the other rays towards a ball, marks those that met what moved, or meet it now.
  void mark_met(const SampleRays& rays, size_t sample, const trace::MovedObject& moved,
                const Ball& ball, Scratch& scratch) const;
  /// Of the other rays towards a ball, marks those that ask a sun again.
  void mark_shaded(const SampleRays& rays, size_t sample, const Ball& ball, Scratch& scratch) const;
  /// Where the chains of these rays end.
  void find_tips(std::span<const uint32_t> which, size_t sample, trace::Ways& tips) const;
  /// Marks tips that the change may shade, or shaded.
  void mark_shadows(std::span<const uint32_t> lights, trace::Ways& tips) const;
  /// Whether the object is now before the first hit of a ray.
  bool hides(const trace::MovedObject& moved, const SampleRays& rays, uint32_t ray,
             Vec3f hit) const;
  /// Whether a ray meets the object now, wherever it lands.
  bool meets(const trace::MovedObject& moved, const SampleRays& rays, uint32_t ray) const;
  /// Whether the change may have shaded a point between a chain's segments from a beam.
  bool bends_shaded(uint32_t chain) const;
  template <class Points>
  bool touches_beams(const Points& points) const;
  /// What to do about a chain that goes on behind its first hit, if nothing new hides that, and if
  /// beams still shine where the chain depends on them.
  Stale bent(uint32_t chain, bool in_beam, const Around& around) const;
  /// The same where its way is as before. `apart`: see Around.
  Stale asking(uint32_t chain, bool apart) const;
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
  std::vector<uint32_t> beam_lights_;               // by beam
  bool suns_;                  // whether one of the suns that are asked at hits changed
  bool keeps_ways_;            // whether chains can ask lights again without being cast again
  direct::Shapes changed_;     // of the lights that changed, before and after
  bool everywhere_ = false;    // whether these may matter anywhere
  uint64_t placed_;            // one bit per beam: its lamp changed
  std::vector<Ball> landing_;  // by cell, see each_landing(); empty if nothing moved
  std::vector<uint8_t> in_shaded_beam_;    // by cell, see find_shaded_beams()
  std::vector<std::vector<Ball>> passed_;  // by changed object: around all that it passed
  std::vector<Ball> shaded_;               // around what suns are shaded from, or were
};

}  // namespace deltalux::gather
