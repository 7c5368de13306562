// SPDX-License-Identifier: Apache-2.0
// What each sample sees in its fixed directions: cells, chains, or nothing.
#pragma once
#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "gather/chain_pool.h"
#include "gather/directions.h"

namespace deltalux::gather {

/// A movable that moved, appeared or vanished: RayCaster::object_bounds.
struct MovedObject {
  uint32_t object;
  std::vector<Box> passed;  ///< where it was or is
  Box now;                  ///< empty: it is gone
};

/// What differs between two states of the scene.
struct Change {
  std::vector<MovedObject> objects;
  bool lights = false;           ///< a light moved, came, or was switched
  std::vector<uint8_t> samples;  ///< per sample: 1 = its receiver changed, or its shares did
  BeamChange beams;
  bool suns = false;  ///< one that is asked for where rays land turned, or was switched
  /// Adds what happened after it.
  void merge(const Change& later);
};

class Looks {
 public:
  Looks(RayCounts counts, uint64_t seed);

  const RayCounts& rays() const { return rays_; }
  size_t samples() const { return rays_.receivers(); }
  /// All rays from scratch. Throws Cancelled: then this object is of no use.
  void cast(const Present& present, const Workers& workers, Progress& progress);
  /// Notes what follow() has to take in.
  void note(const Present& present, const Change& change);
  /// Casts again what may differ, nearest to what moved first, until all is as cast() would have it
  /// or `more` says no; it is asked every few milliseconds. Samples that cast all their rays begin
  /// with one part of them and go on, twice as many at a time, when the rest is done. Calls
  /// renew(sample), by many threads, before: its shares may follow it then. Returns how many rays
  /// were cast.
  uint64_t follow(const Present& present, const Workers& workers, Progress& progress,
                  const std::function<void(size_t)>& renew, const std::function<bool()>& more);
  /// Share of the samples that wait.
  double pending_share() const;
  /// Whether a ray of the sample was cast since forget_changes().
  bool changed(size_t sample) const { return changed_[sample]; }
  void forget_changes() { std::fill(changed_.begin(), changed_.end(), uint8_t(0)); }

  /// Of ray `ray` of a sample: a cell, kDark, or kChain + index into chains(). As long as only the
  /// first parts of its rays are of the present state, of those.
  static constexpr uint32_t kChain = 0x80000000u;
  std::span<const uint32_t> targets(size_t sample) const {
    return std::span(targets_).subspan(rays_.first(sample), shown(sample));
  }
  /// What the light along each ray of a sample counts times; empty: once.
  std::span<const float> weights(size_t sample) const {
    return weights_.empty() ? std::span<const float>{}
                            : std::span(weights_).subspan(rays_.first(sample), shown(sample));
  }
  static bool is_chain(uint32_t target) { return target >= kChain && target != kDark; }
  static uint32_t chain_of(uint32_t target) { return target - kChain; }
  const ChainPool& chains() const { return chains_; }
  /// Before an Evaluation reads them.
  void paint(const Paint& paint, const Workers& workers) { chains_.paint(paint, workers); }
  size_t bytes() const;
  /// The same without what lies idle.
  size_t bytes_in_use() const;
  /// Chains that a ray begins, and their vertices, on average.
  struct PerRay {
    double chains = 0.2, vertices = 0.5;
    double bytes(bool weighted = true) const;
  };
  /// Of those that samples cast in addition where light is noisy: beside contacts above all.
  static constexpr PerRay kAddedRays{0.4, 1.0};
  PerRay per_ray() const;
  /// While samples of so many rays each are cast, what their portions take besides.
  static double forecast_working_bytes(size_t samples, double rays, const PerRay& per_ray);

  /// Arrays named "gather.…".
  void save(ArchiveView& archive) const;
  /// What save() wrote, in the same state. Throws FormatError or Cancelled: then this object is of
  /// no use.
  void restore(ArchiveSource& archive, const Present& present, const Workers& workers,
               Progress& progress);

 private:
  class Caster;
  class Suspects;
  /// Changes that are taken in block by block of kBlock samples.
  struct Task {
    uint32_t block;
    uint32_t part, end;  ///< of the rays of samples that cast all of them
    float distance;
  };
  struct Pending {
    Change change;
    std::vector<Task> order;
    size_t done = 0;
  };
  /// What was cast again.
  struct Found {
    struct Ray {
      size_t place;  ///< in targets_
      uint32_t target;
      float weight;
      bool in_beam;
    };
    struct Chained {
      uint32_t count, end;
      float weight;
      Passage passage;
    };
    std::vector<Ray> rays;         ///< targets of chains: kChain
    std::vector<Chained> chained;  ///< of those, in their order
    std::vector<Vertex> vertices;  ///< of all of these, one after the other
  };
  /// Rays of the first parts; of the first one at least one.
  uint32_t rays_of(size_t sample, uint32_t parts) const {
    const uint32_t all = rays_.count(sample);
    return parts ? std::max(1u, all * parts / kParts) : 0;
  }
  uint32_t shown(size_t sample) const { return rays_of(sample, parts_[sample]); }
  void set(const Found& found);
  bool in_beam(size_t place) const {
    return !in_beam_.empty() && in_beam_[place / 64] >> (place % 64) & 1;
  }

  RayCounts rays_;
  uint64_t seed_;
  Directions directions_;
  std::vector<uint32_t> targets_;
  std::vector<float> weights_;     // per target; empty without guides
  std::vector<uint64_t> in_beam_;  // a bit per target; empty without beams
  std::vector<uint8_t> changed_;   // per sample
  std::vector<uint8_t> parts_;     // per sample: so many of its rays are of the present state
  ChainPool chains_;
  std::optional<Pending> pending_;
};

}  // namespace deltalux::gather
