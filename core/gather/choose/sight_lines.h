// SPDX-License-Identifier: Apache-2.0
// Rays from samples that meet far brighter places than the sample's other rays do: such a place is
// often seen through a small opening.
#pragma once
#include <span>
#include <vector>

#include "gather/aim/directions.h"
#include "gather/aim/guide.h"
#include "gather/cells/cells.h"
#include "gather/hits/chain.h"
#include "gather/hits/evaluate.h"

namespace deltalux::gather {

/// A ray from a sample to a place that is much brighter than what its other rays meet.
struct SightLine {
  static constexpr float kEnds = 0.05f;  ///< share of a line at its start that is no opening

  Vec3f from, w;
  float length;
  float around;   ///< mean radiosity that the sample's rays meet
  double weight;  ///< share of the sample's variance

  /// The parameter, within the line's middle part, of the point closest to `p`.
  float closest(Vec3f p) const { return std::clamp(dot(p - from, w), kEnds * length, length); }
  Vec3f at(float t) const { return from + w * t; }
  float distance(Vec3f p) const { return deltalux::length(at(closest(p)) - p); }
};

/// Such a ray that was sent past a corner of a triangle.
struct Passing {
  Vec3f from;
  uint32_t primitive;
  Vec3f at;      ///< where it crosses the triangle's plane
  Vec3f normal;  ///< of that plane, towards `from`
  float around;
};

/// What the rays of one sample meet.
struct Look {
  std::vector<SightLine> bright;
  std::vector<Passing> passing;
  double variance = 0;  ///< sum of the squares of the rays' shares
  float around = 0;
};

/// Casts rays from samples.
struct Eyes {
  /// Times the mean radiosity that a place's rays hit: one such ray in 256 brings 6 % of the light.
  static constexpr float kBright = 16;

  const Context& context;
  const Evaluation& evaluation;
  const CellFinder& finder;
  std::span<const Guide> known;  ///< lines that end on their places are left out
  const Directions& directions;
  uint32_t rays;     ///< by the cosine, of each sample
  uint32_t corners;  ///< past corners of static geometry
  uint64_t seed;

  static Vec3f origin(const direct::Receiver& receiver) {
    return receiver.point + receiver.normal * receiver.slack();
  }
  Look look(const direct::Receiver& receiver) const;
  /// Radiosity at the end of a ray that goes on beyond `beyond`; 0 if there is none.
  float radiosity(Vec3f from, Vec3f w, float beyond = 0) const;

 private:
  void look_past_corners(const direct::Receiver& receiver, Look& out) const;
};

/// Lets a guide have the light that is seen through its square from these places in turn; `looks`:
/// of each texel.
void paint(const Eyes& eyes, std::span<const Vec3f> from, uint32_t looks, Guide& guide);

}  // namespace deltalux::gather
