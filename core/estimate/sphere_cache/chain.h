// SPDX-License-Identifier: Apache-2.0
// Geometry of the sphere cache (paper 2.3): where the spheres stand, which of them a disc makes
// invalid. Knows nothing of segments.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace deltalux::estimate::sphere_cache {

/// Which spheres a disc must lie inside, that none need be rebuilt.
enum class Containment : uint8_t {
  all,     ///< in every sphere, the outermost is checked first; exact
  nested,  ///< likewise, and a sphere lies inside the one around it; exact
  /// As printed in the paper: the innermost sphere that holds the disc is kept, whether or not
  /// those around it do. LOSSY: a sphere that stands out of its parent lacks the segments there.
  literal,
};

struct DiscPlace {
  Vec3d centre, normal;  ///< of unit length, or zero
  double radius = 0;
  int last = 0;  ///< level of the smallest sphere that is larger than the disc
};

/// Spheres S_1 to S_present. S_0 holds all segments wherever they are: it is not looked at.
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
    // Products with a far too short or long normal may underflow or overflow, so that hits lie off
    // the disc's plane. Without a normal holds() wants the whole ball.
    const Vec3d n(normal);
    const bool usual = dot(n, n) > 1e-20 && dot(n, n) < 1e20;
    return {Vec3d(centre), usual ? normalize(n) : Vec3d(), radius,
            int(smaller - radius_.begin()) - 1};
  }

  /// h^2 + (rho + d)^2 <= r^2, with h the height of the sphere's centre over the disc's plane and
  /// rho its distance from the axis.
  bool holds(int level, const DiscPlace& disc) const {
    const double r = radius_[size_t(level)], room = r - disc.radius;
    const Vec3d from = disc.centre - centre_[size_t(level)];
    const double distance2 = dot(from, from);
    if (room >= 0 && distance2 <= room * room) return true;
    const double h = dot(from, disc.normal);
    const double rim = std::sqrt(std::max(0.0, distance2 - h * h)) + disc.radius;
    return h * h + rim * rim <= r * r;
  }

  /// First level that must be centred on the disc, at most disc.last + 1. Spheres too small for
  /// this disc are left to those that follow. `more`: the innermost list is worth subdividing.
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

  /// Centres the spheres from `level` to disc.last on the disc; smaller ones are gone.
  void centre_on(const DiscPlace& disc, int level) {
    for (int i = level; i <= disc.last; ++i) centre_[size_t(i)] = disc.centre;
    present = disc.last;
  }

 private:
  /// True if S_level around the disc would lie inside the sphere around it.
  bool fits(int level, const DiscPlace& disc) const {
    const double room = radius_[size_t(level) - 1] - radius_[size_t(level)];
    return length(disc.centre - centre_[size_t(level) - 1]) <= room;
  }

  const std::vector<double>& radius_;
  Containment containment_;
  std::vector<Vec3d> centre_;
};

}  // namespace deltalux::estimate::sphere_cache
