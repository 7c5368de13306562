// SPDX-License-Identifier: Apache-2.0
// Geometry of the sphere cache (paper 2.3): positions of spheres, and which spheres a disc
// invalidates. Independent of segments.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace deltalux::estimate::sphere_cache {

/// Which spheres must contain a disc, so that none has to be rebuilt.
enum class Containment : uint8_t {
  all,     ///< all spheres, checked from the outermost; exact
  nested,  ///< the same, and each sphere lies inside the one around it; exact
  /// As printed in the paper: the innermost sphere that contains the disc is kept, even if those
  /// around it do not contain it. LOSSY: a sphere that extends beyond its parent lacks the segments
  /// there.
  literal,
};

struct DiscPlace {
  Vec3d centre, normal;  ///< of unit length, or zero
  double radius = 0;
  int last = 0;  ///< level of the smallest sphere larger than the disc
};

/// The spheres S_1 to S_present. S_0 contains all segments wherever they are, and is not considered
/// here.
class SphereChain {
 public:
  /// `radius` of S_0, S_1, ..., descending.
  SphereChain(const std::vector<double>& radius, Containment containment)
      : radius_(radius), containment_(containment), centre_(radius.size()) {}

  int present = 0;
  Vec3d centre(int level) const { return centre_[size_t(level)]; }

  DiscPlace place(Vec3f centre, Vec3f normal, float radius) const {
    const auto smaller = std::partition_point(radius_.begin() + 1, radius_.end(),
                                              [&](double r) { return r > double(radius); });
    // Products with a far too short or too long normal may underflow or overflow, so that hits
    // deviate from the disc's plane. Without a normal, holds() requires the whole ball.
    const Vec3d n(normal);
    const bool usual = dot(n, n) > 1e-20 && dot(n, n) < 1e20;
    return {Vec3d(centre), usual ? normalize(n) : Vec3d(), radius,
            int(smaller - radius_.begin()) - 1};
  }

  /// Whether the sphere contains the disc: h^2 + (rho + d)^2 <= r^2, with h the height of the
  /// sphere's centre above the disc's plane and rho its distance from the axis.
  bool holds(int level, const DiscPlace& disc) const {
    const double r = radius_[size_t(level)], room = r - disc.radius;
    const Vec3d from = disc.centre - centre_[size_t(level)];
    const double distance2 = dot(from, from);
    if (room >= 0 && distance2 <= room * room) return true;
    const double h = dot(from, disc.normal);
    const double rim = std::sqrt(std::max(0.0, distance2 - h * h)) + disc.radius;
    return h * h + rim * rim <= r * r;
  }

  /// The first level that must be centred on the disc, at most disc.last + 1. Spheres too small for
  /// this disc are kept for later discs. `more`: whether the innermost list should be subdivided.
  int first_to_centre(const DiscPlace& disc, bool more) const {
    const int checked = std::min(present, disc.last);
    int level = 1;
    if (containment_ == Containment::literal) {
      level = checked;
      while (level > 0 && !holds(level, disc)) --level;
      return level + 1;
    }
    while (level <= checked && holds(level, disc)) ++level;
    const bool built = level <= checked || (level <= disc.last && more);
    if (containment_ == Containment::nested && built)
      while (level > 1 && !fits(level, disc)) --level;
    return level;
  }

  /// Centres the spheres from `level` to disc.last on the disc; smaller ones are dropped.
  void centre_on(const DiscPlace& disc, int level) {
    for (int i = level; i <= disc.last; ++i) centre_[size_t(i)] = disc.centre;
    present = disc.last;
  }

 private:
  /// Whether S_level around the disc would lie inside the sphere around it.
  bool fits(int level, const DiscPlace& disc) const {
    const double room = radius_[size_t(level) - 1] - radius_[size_t(level)];
    return length(disc.centre - centre_[size_t(level) - 1]) <= room;
  }

  const std::vector<double>& radius_;
  Containment containment_;
  std::vector<Vec3d> centre_;
};

}  // namespace deltalux::estimate::sphere_cache
