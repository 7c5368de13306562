// SPDX-License-Identifier: Apache-2.0
// Interfaces of estimators. Methods that average over a fixed area can add and remove segments
// (SignedEstimator); methods that average over a fixed number of photons cannot (GatherEstimator).
#pragma once
#include <atomic>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/assertion.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "samples/disc_set.h"
#include "segments/hit_slots.h"
#include "segments/segment_span.h"

namespace deltalux::estimate {

/// Integer energy per slab, sample and channel: data[(slab * samples + sample) * 3 + channel].
/// A slab is one light group's share of one batch of paths.
struct EnergySums {
  int64_t* data = nullptr;
  size_t samples = 0;
  /// Whether several threads may write to `data` at a time. Plain additions save a tenth of a
  /// deposit's time.
  bool shared = true;

  /// Optional first moments of the crossings, for surface gradients. Laid out like `data`, but with
  /// six numbers per sample: channel x (u, v) of tangent_frame(normal), in quanta times radius /
  /// kMomentSteps.
  int64_t* moments = nullptr;
  static constexpr float kMomentSteps = 64;

  /// Optional: one mark for each block of kMarked samples of a slab, set where `data` may change.
  uint8_t* marks = nullptr;
  static constexpr size_t kMarked = 256;
  static size_t marks_of_slab(size_t samples) { return (samples + kMarked - 1) / kMarked; }
  void mark(uint32_t slab, uint32_t sample) const {
    if (marks) marks[slab * marks_of_slab(samples) + sample / kMarked] = 1;
  }

  int64_t* cell(uint32_t slab, uint32_t sample) const {
    DELTALUX_ASSERT(data && sample < samples);
    return data + (size_t(slab) * samples + sample) * 3;
  }
  /// Thread-safe if `shared`; integer addition makes the order irrelevant.
  void add(uint32_t slab, uint32_t sample, const uint32_t power[3], int64_t sign) const {
    DELTALUX_ASSERT(!shared || !marks);
    mark(slab, sample);
    int64_t* sums = cell(slab, sample);
    for (int c = 0; c < 3; ++c) {
      const int64_t energy = sign * int64_t(power[c]);
      if (shared)
        std::atomic_ref<int64_t>(sums[c]).fetch_add(energy, std::memory_order_relaxed);
      else
        sums[c] += energy;
    }
  }
};

/// Adds one crossing to the moments of `sums`.
inline void add_moments(const EnergySums& sums, const samples::DiscSet& discs, size_t disc,
                        Vec3f offset, uint32_t slab, const uint32_t power[3], int64_t sign) {
  Vec3f u, v;
  tangent_frame(discs.normal[disc], u, v);
  const float steps = EnergySums::kMomentSteps / discs.radius[disc];
  const auto a = int64_t(std::nearbyint(dot(offset, u) * steps));
  const auto b = int64_t(std::nearbyint(dot(offset, v) * steps));
  int64_t* cell = sums.moments + (size_t(slab) * sums.samples + discs.id[disc]) * 6;
  for (int c = 0; c < 3; ++c) {
    cell[2 * c] += sign * a * int64_t(power[c]);
    cell[2 * c + 1] += sign * b * int64_t(power[c]);
  }
}

/// Statistics of a call; the caller sums them over calls.
struct Stats {
  uint64_t disc_tests = 0, node_tests = 0, sphere_tests = 0, triangle_tests = 0, hits = 0;
  /// on hits of the circles of clipped discs; brute force does not count them
  uint64_t outline_tests = 0;
  Stats& operator+=(const Stats& o) {
    disc_tests += o.disc_tests, node_tests += o.node_tests;
    sphere_tests += o.sphere_tests, triangle_tests += o.triangle_tests, hits += o.hits;
    outline_tests += o.outline_tests;
    return *this;
  }
};

using segments::HitSlots;

class SignedEstimator {
 public:
  virtual ~SignedEstimator() = default;
  /// Adds (sign +1) or removes (-1) each segment's power to the sums of every disc it crosses.
  /// Thread-safe, exact, independent of order. Writes `slots` (one per segment) unless null.
  virtual Stats accumulate(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                           HitSlots* slots = nullptr) const = 0;
  virtual const samples::DiscSet& discs() const = 0;
  /// Memory of the discs and of everything kept between calls.
  virtual size_t bytes() const { return discs().bytes(); }
  /// How many segments to pass at a time: more for methods with a cost per call.
  virtual size_t best_span() const { return 256; }
};

/// The result of a gather method: irradiance in quanta per square metre, three per sample.
struct Gathered {
  std::vector<double> irradiance;
  Stats stats;
};

class GatherEstimator {
 public:
  virtual ~GatherEstimator() = default;
  /// Irradiance at all samples from these segments only. The result does not depend on the number
  /// of workers. Throws Cancelled.
  virtual Gathered estimate(const segments::SegmentSpan& segments, const Workers& workers,
                            Progress* progress = nullptr) const = 0;
};

}  // namespace deltalux::estimate
