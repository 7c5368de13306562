// SPDX-License-Identifier: Apache-2.0
// What each sample's gather rays met: by ray a cell, a chain, or nothing.
#pragma once
#include <algorithm>
#include <bit>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "gather/aim/directions.h"
#include "gather/hits/chain_pool.h"
#include "trace/change.h"

namespace deltalux::gather {

/// The difference between two states of what gather rays depend on.
struct Change {
  trace::Change scene;
  /// By sample: 1 if its receiver changed, or the shares of its rays.
  std::vector<uint8_t> samples;
  /// By beam and point: 1 if the point differs; empty if none does.
  std::vector<uint8_t> points;
  /// Adds a later change.
  void merge(const Change& later);
};

/// The hits of all samples.
class GatherHits {
 public:
  GatherHits(RayCounts counts, uint64_t seed);

  const RayCounts& rays() const { return rays_; }
  size_t samples() const { return rays_.receivers(); }
  /// Casts all rays. Throws Cancelled; this object is then useless.
  void cast(const Context& context, const Workers& workers, Progress& progress);
  /// Bounds what follow() reads of chains; it does so itself where that was not done.
  void bound_chains(const Context& context, const Workers& workers);
  /// Forgets all rays: they are dark until restore_samples() brings them.
  void clear(const Guiding& guiding);
  /// Records a change for follow().
  void note(const Context& context, const Change& change);
  /// Rays that were cast again, or whose chains cast some to lights again; and those of them that
  /// brought something else than before.
  struct Cast {
    uint64_t rays = 0, changed = 0;
    Cast& operator+=(const Cast& other) {
      rays += other.rays, changed += other.changed;
      return *this;
    }
  };
  /// Recasts the rays that recorded changes may affect, nearest to the moved objects first, until
  /// the result is that of cast() or more() returns false, which is called every few milliseconds.
  /// Samples that have to cast all their rays begin with an eighth of them; after all other samples
  /// are done, they continue, doubling the number each time. Calls renew(sample) before such a
  /// sample casts rays, from several threads, so that the caller can update the shares of its rays.
  Cast follow(const Context& context, const Workers& workers, Progress& progress,
              const std::function<void(size_t)>& renew, const std::function<bool()>& more);
  /// Share of the recorded work that remains.
  double pending_share() const;
  /// Whether the sample cast a ray since forget_changes().
  bool changed(size_t sample) const { return changed_[sample]; }
  void forget_changes() { std::fill(changed_.begin(), changed_.end(), uint8_t(0)); }

  /// By ray of a sample: a cell, kDark, or kChain + index into chains(), with kStraight if the
  /// chain ends at its first hit. While only the first parts of its rays are up to date, only these
  /// are returned.
  static constexpr uint32_t kChain = 0x80000000u, kStraight = 0x40000000u;
  std::span<const uint32_t> targets(size_t sample) const {
    return std::span(targets_).subspan(rays_.first(sample), shown(sample));
  }
  /// Factors of the light along each ray of a sample; empty if all are 1.
  std::span<const float> weights(size_t sample) const {
    return weights_.empty() ? std::span<const float>{}
                            : std::span(weights_).subspan(rays_.first(sample), shown(sample));
  }
  /// Whether ray `place`, counted over all samples, depends on where a beam's light lands, see
  /// Chain::in_beam.
  bool in_beam(size_t place) const {
    return !in_beam_.empty() && in_beam_[place / 64] >> (place % 64) & 1;
  }
  static bool is_chain(uint32_t target) { return target >= kChain && target != kDark; }
  static bool goes_on(uint32_t target) { return target - kChain < kStraight; }
  static bool is_straight(uint32_t target) { return is_chain(target) && !goes_on(target); }
  static uint32_t chain_of(uint32_t target) { return target & (kStraight - 1); }
  const ChainPool& chains() const { return chains_; }
  /// The cell that a ray ends at, if not before.
  uint32_t end_of(uint32_t target) const {
    return is_chain(target) ? chains_.end(chain_of(target)) : target;
  }
  /// Calls visit(ray) for the sample's rays that are in a beam, ascending.
  template <class Visit>
  void each_in_beam(size_t sample, const Visit& visit) const {
    const size_t first = rays_.first(sample), end = first + shown(sample);
    if (in_beam_.empty() || first == end) return;
    for (size_t word = first / 64; word <= (end - 1) / 64; ++word)
      for (uint64_t bits = in_beam_[word]; bits; bits &= bits - 1)
        if (const size_t place = 64 * word + size_t(std::countr_zero(bits));
            place >= first && place < end)
          visit(uint32_t(place - first));
  }
  /// Prepares chains for reading by an Evaluation, see ChainPool::paint().
  void paint(const Paint& paint, const Workers& workers) { chains_.paint(paint, workers); }
  size_t bytes() const;
  /// The same without unused capacity.
  size_t bytes_in_use() const;
  /// Average number of chains per ray, and of their vertices, and the bytes of one of these.
  struct PerRay {
    double chains = 0.2, vertices = 0.5;
    double vertex_bytes = double(ChainPool::kVertexBytes);
    double bytes(bool weighted = true) const;
  };
  /// The same for the additional rays of noisy samples, most of which are close to contacts.
  static constexpr PerRay kAddedRays{0.4, 1.0, double(ChainPool::kVertexBytes)};
  PerRay per_ray() const;
  /// Temporary memory while cast() runs, for samples with so many rays each.
  static double forecast_working_bytes(size_t samples, double rays, const PerRay& per_ray);

  /// Writes arrays named "gather.…".
  void save(ArchiveView& archive) const;
  /// Restores what save() wrote, in the same state. Throws FormatError or Cancelled; this object is
  /// then useless.
  void restore(ArchiveSource& archive, const Context& context, const Workers& workers,
               Progress& progress);
  /// Restores samples [first, last), which are dark, from what an object of these samples alone
  /// saved. Throws like restore().
  void restore_samples(size_t first, size_t last, ArchiveSource& archive, const Context& context,
                       Progress& progress);

 private:
  class Caster;
  /// A step of follow(): one block of kBlock samples.
  struct Task {
    uint32_t block;
    uint32_t part, end;  ///< part of the rays, for samples that cast all of them
    float distance;
  };
  /// Changes that follow() has not applied yet.
  struct Pending {
    Change change;
    std::vector<Task> order;
    size_t done = 0;
  };
  /// Results of cast rays, not stored yet.
  struct CastRays {
    struct Ray {
      size_t place;  ///< index in targets_
      uint32_t target;
      float weight;
      bool in_beam;
    };
    struct Chained {
      uint32_t count, end;
      float weight;
      Vec3f tip;
    };
    std::vector<Ray> rays;         ///< the target of a chain is kChain
    std::vector<Chained> chained;  ///< chains of these rays, in their order
    std::vector<Vertex> vertices;  ///< vertices of these chains, one after the other
    std::vector<Place> places;
    std::vector<Tint> tints;
    std::vector<uint32_t> relit;         ///< chains whose lights were asked again
    std::vector<Vertex> relit_vertices;  ///< of these, one after the other
    void add(const Chain& chain) {
      chained.push_back({chain.count, chain.end, chain.weight, chain.tip});
      const Points own = chain.points();
      vertices.insert(vertices.end(), own.vertices.begin(), own.vertices.end());
      places.insert(places.end(), own.places.begin(), own.places.end());
      tints.insert(tints.end(), own.tints.begin(), own.tints.end());
    }
    Points points() const { return {vertices, places, tints}; }
    /// Grows a box by all segments but the first and last of the chains whose vertices come from
    /// this one on.
    void grow_by_bends(size_t first, Box& box) const {
      for (size_t k = first; k < vertices.size(); ++k)
        if (!vertices[k].is_of_end()) box.grow(places[k].point());
    }
    Cast asked;  ///< chains that cast rays to lights again, and how many of these brought another
  };
  /// Number of rays in the first `parts` parts; at least one unless `parts` is 0.
  uint32_t rays_of(size_t sample, uint32_t parts) const {
    const uint32_t all = rays_.count(sample);
    return parts ? std::max(1u, all * parts / kParts) : 0;
  }
  /// Number of the sample's rays that are up to date.
  uint32_t shown(size_t sample) const { return rays_of(sample, parts_[sample]); }
  /// Stores a chain and returns the target of its ray.
  uint32_t store(const Points& points, uint32_t end, float weight, Vec3f tip) {
    return kChain + (points.vertices.front().is_of_end() ? kStraight : 0) +
           chains_.add(points, end, weight, tip);
  }
  /// Stores results. Returns how many there are, and differ from what was stored.
  Cast set(const CastRays& found);

  RayCounts rays_;
  uint64_t seed_;
  Directions directions_;
  std::vector<uint32_t> targets_;
  std::vector<float> weights_;     // by target; empty without guides
  std::vector<uint64_t> in_beam_;  // one bit per target; empty without beams
  std::vector<uint8_t> changed_;   // by sample, see changed()
  std::vector<uint8_t> parts_;     // by sample: the number of parts of its rays that are up to date
  ChainPool chains_;
  std::optional<Pending> pending_;
  // By sample: bounds of all segments of its chains but the last, past ones included. Empty before
  // bound_chains().
  std::vector<Box> near_;
};

}  // namespace deltalux::gather
