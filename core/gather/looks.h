// SPDX-License-Identifier: Apache-2.0
// What each sample sees in its fixed directions: cells, chains, or nothing.
#pragma once
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "gather/chain_pool.h"
#include "gather/directions.h"

namespace deltalux::gather {

/// What differs between two states of the scene.
struct Change {
  std::vector<uint32_t> objects;  ///< movables that moved, appeared or vanished
  std::vector<Box> boxes;         ///< RayCaster::object_bounds, before and after
  std::vector<Box> after;         ///< those of them that are there now
  bool lights = false;            ///< a light moved, came, or was switched
  std::vector<uint8_t> samples;   ///< per sample: 1 = its receiver changed
};

class Looks {
 public:
  Looks(size_t samples, uint32_t rays, uint64_t seed);

  uint32_t rays() const { return directions_.count(); }
  size_t samples() const { return samples_; }
  /// All rays from scratch. Throws Cancelled: then this object is of no use.
  void cast(const Present& present, const Workers& workers, Progress& progress);
  /// Casts again what may differ: afterwards everything is as cast() would have it. Returns how
  /// many rays that were.
  uint64_t update(const Present& present, const Change& change, const Workers& workers,
                  Progress& progress);

  /// Of ray `ray` of a sample: a cell, kDark, or kChain + index into chains().
  static constexpr uint32_t kChain = 0x80000000u;
  std::span<const uint32_t> targets(size_t sample) const {
    return std::span(targets_).subspan(sample * rays(), rays());
  }
  /// What the light along each ray of a sample counts times; empty: once.
  std::span<const float> weights(size_t sample) const {
    return weights_.empty() ? std::span<const float>{}
                            : std::span(weights_).subspan(sample * rays(), rays());
  }
  static bool is_chain(uint32_t target) { return target >= kChain && target != kDark; }
  static uint32_t chain_of(uint32_t target) { return target - kChain; }
  const ChainPool& chains() const { return chains_; }
  size_t bytes() const;
  static double forecast_bytes(size_t samples, uint32_t rays);

  /// Arrays named "gather.…".
  void save(ArchiveView& archive) const;
  /// What save() wrote, in the same state. Throws FormatError: then this object is of no use.
  void restore(ArchiveSource& archive, const Present& present, const Workers& workers);

 private:
  class Caster;
  class Suspects;
  /// What was cast again.
  struct Found {
    struct Chained {
      size_t place;
      uint32_t count, end;
      float weight;
      Passage passage;
    };
    std::vector<std::pair<size_t, uint32_t>> plain;  ///< place in targets_, target
    std::vector<Chained> chained;
    std::vector<Vertex> vertices;  ///< of all of these, one after the other
  };
  void set(const Found& found);
  /// Of the samples whose receivers changed, or of all.
  void weigh(const Present& present, const std::vector<uint8_t>* changed, const Workers& workers);

  size_t samples_;
  uint64_t seed_;
  Directions directions_;
  std::vector<uint32_t> targets_;
  std::vector<float> weights_;  // per target; empty without guides
  ChainPool chains_;
};

}  // namespace deltalux::gather
