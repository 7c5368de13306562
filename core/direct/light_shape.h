// SPDX-License-Identifier: Apache-2.0
// A light as receivers see it: unshadowed irradiance, and shadow rays.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/random.h"
#include "base/vec.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// A surface point whose irradiance is computed. A zero normal (of a removed object) receives none.
/// Shadow rays start slightly off the surface, see slack().
struct Receiver {
  Vec3f point, normal;
  uint32_t object = scene::kNone;  ///< the movable that it lies on, or kNone
  /// Scene::slack_of() of the surface that it lies on.
  float plane = 0;
  uint64_t key = 0;  ///< key of random numbers, which stay the same when its object moves
  float slack() const { return position_slack(point) + plane; }
  friend bool operator==(const Receiver&, const Receiver&) = default;
};

/// A key that depends on the place only, not on the sample's index, so that other samples do not
/// affect it.
uint64_t place_key(Vec3f point, Vec3f normal);

/// How many shadow rays sample a light; a punctual light has one ray in any. Middle: the coarse
/// ones without those to the extremities.
enum class Detail : uint8_t { coarse, middle, fine };
inline constexpr uint32_t kCoarseRays = 36, kFineRays = 256;
/// Additional rays to the extremities of an area light: they only distinguish full from partial
/// visibility.
inline constexpr uint32_t kCorners = 4;
/// A fine stratum that is divided gets kParts x kParts rays.
inline constexpr uint32_t kParts = 4, kDivided = kFineRays / (kParts * kParts);

/// Bits of the coarse rays, and of those to the extremities.
inline constexpr uint64_t kCoarseBits = (uint64_t(1) << kCoarseRays) - 1;
inline constexpr uint64_t kCornerBits = ((uint64_t(1) << kCorners) - 1) << kCoarseRays;
static_assert(kCoarseRays == 36);
/// Bits of a third (0 to 2) of the coarse rays, equally many in each row and column of the strata.
constexpr uint64_t few_rays(uint32_t third) {
  constexpr uint64_t kFewRays = 0x88c462311;
  return (kFewRays << 3 * third | kFewRays >> (kCoarseRays - 3 * third)) & kCoarseBits;
}

/// Shadow rays to a light, and what each represents.
struct Strata {
  trace::RayFan fan;
  alignas(
      64) std::array<float, trace::RayFan::kMaxRays> weight;  ///< unnormalised share of the light
  trace::RayBits countable{};  ///< rays in front of both the receiver and the light
  trace::RayBits nearly{};     ///< of divide(): rays in whose strata some points are
  /// how many strata lie beside each other across the light's triangles; the next column follows
  uint32_t rows = 1;
  /// whether the light is close or large, so that fine detail is needed
  bool too_coarse = false;

  /// The share of the light, in [0, 1], that the rays in `seen` (a subset of `countable`)
  /// represent.
  double share(const trace::RayBits& seen) const;
};

class LightShape {
 public:
  /// `number`: index of the light; with `seed` and the receiver it determines the points in the
  /// strata. `reference`: of what receivers get from all lights, to tell lights that matter
  /// little; 0 if all matter.
  LightShape(const trace::Light& light, uint32_t number, uint64_t seed, double reference = 0);

  /// Unshadowed irradiance, in units of brightest(); exact for area lights.
  double open(const Receiver& receiver) const;
  /// A fast approximation of open(): zero only if open() is zero; otherwise within a small factor
  /// of it, unless the receiver is close to the light.
  double about(const Receiver& receiver) const;
  /// Whether the light is small as seen from the receiver, so that all its points contribute about
  /// equally.
  bool is_small(const Receiver& receiver) const;
  /// One shadow ray to a point drawn uniformly from the light's surface by `u` and `v` in [0, 1),
  /// and the irradiance if it is unoccluded, in units of brightest(). The estimate is unbiased.
  struct Glance {
    Vec3f origin, direction;
    float to;
    double irradiance;
  };
  Glance glance(const Receiver& receiver, float u, float v) const;
  /// Radiance, or intensity, of the strongest channel.
  double brightest() const { return brightest_; }
  /// Points whose convex hull contains an area light: the corners of few triangles, or of a box.
  std::span<const Vec3f> outline() const { return outline_; }
  /// Whether the light can give the receiver only a small share of what receivers get.
  bool is_minor(const Receiver& receiver) const;
  /// Whether a light that gives so much where nothing hides it is one of few that matter.
  bool is_major(double open) const { return !(open < major_); }
  /// Makes the shadow rays of a level. A light that is minor, or very small as seen from the
  /// receiver, gets a third of the coarse rays; one that gives next to nothing gets a single one. A
  /// minor light's fine rays are all 36.
  void cast(const Receiver& receiver, Detail detail, Strata& out) const;
  /// The squared distance of neighbours among so many cells of equal area; 0 for a light of few
  /// triangles, whose grid of cells tells it.
  float near(size_t cells) const {
    constexpr float kSides = 1.6f;  // of square cells
    return triangles_.size() > 2 ? kSides * kSides * area_ / float(cells) : 0.0f;
  }
  /// Of random numbers for this light and receiver.
  uint64_t key(const Receiver& receiver) const {
    return combine(key_, place_key(receiver.point, receiver.normal));
  }
  /// Makes rays to cells of an area light: to parts x parts places in each. Cells at depth 0 are
  /// the fine strata, at depth 1 their parts: a grid of kParts times as many rows and columns. Both
  /// are numbered column by column. Together at most kFineRays rays.
  struct Cells {
    std::span<const uint32_t> numbers;  ///< ascending
    uint32_t depth, parts;
  };
  void divide(const Receiver& receiver, const Cells& cells, Strata& out) const;

 private:
  struct Triangle {
    Vec3f corner, edge_u, edge_v, normal;
    float slack;  // at the place, see lift()
    // cumulative share of the light's area before this triangle, and its own share
    float before, share;
  };
  /// What open() and searches read of each triangle, as columns: bulbs consist of thousands.
  struct Columns {
    std::vector<float> x, y, z;                       // corner
    std::vector<float> middle_x, middle_y, middle_z;  // from the corner to the centroid
    std::vector<float> normal_x, normal_y, normal_z, area, longest_squared, before;
    void add(const Triangle& triangle);
  };
  struct Corner {
    Vec3f point, normal;
    float slack;
  };
  void find_corners(Vec3f centre);
  void find_outline(const Box& bounds);
  double open_area(const Receiver& receiver) const;
  bool is_area() const { return !punctual_.kind; }
  double open_punctual(const Receiver& receiver) const;
  void cast_single(const Receiver& receiver, Strata& out) const;
  struct Places;
  void cast_area(const Receiver& receiver, Detail detail, Strata& out) const;
  /// Makes rays to places in the strata with those lower corners, jittered.
  void cast_places(const Receiver& receiver, const Places& places, uint32_t stream,
                   Strata& out) const;
  /// Makes rays to the points (a, b) in these strata.
  void cast_points(const Receiver& receiver, const Places& places, const float* a, const float* b,
                   Strata& out) const;
  /// Gives rays the mean weight of their strata, since that of one point would be an error where a
  /// whole stratum is visible; not where a part of the stratum does not count.
  void smooth(const Receiver& receiver, const Places& places, Strata& out) const;
  /// The coarse rays that a small or faint light does without are not countable.
  void thin(const Receiver& receiver, Strata& out) const;
  void cast_triangle(const Receiver& receiver, Triangle triangle, const float* a, const float* b,
                     size_t begin, size_t end, Strata& out) const;
  void cast_corners(const Receiver& receiver, Strata& out) const;
  const Triangle& triangle_at(float position) const;

  lights::Punctual punctual_;  // without a kind for an area light
  Vec3f centre_{};             // of an area light's bounding box
  float radius_ = 0;           // half of the box's diagonal
  Vec3f facing_{};             // the normal of a flat light; otherwise zero
  std::vector<Triangle> triangles_;
  Columns columns_;
  std::vector<uint32_t> nearby_;  // by n-th of the area, n triangles: where to begin a search
  std::array<Corner, kCorners> corners_;
  std::vector<Vec3f> outline_;
  bool two_sided_, on_;
  uint64_t key_;
  float area_ = 0;
  double brightest_;
  double faint_ = 0, minor_ = 0;  // about() of less than these
  double major_ = 0;              // open() of at least this
  uint32_t rows_[2] = {1,
                       1};  // per detail: strata across a triangle; columns run along the triangles
};

}  // namespace deltalux::direct
