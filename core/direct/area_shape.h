// SPDX-License-Identifier: Apache-2.0
// Lights with a surface: strata of their triangles, each with a shadow ray.
#pragma once
#include <array>
#include <vector>

#include "direct/light_shape.h"

namespace deltalux::direct {

class AreaShape final : public LightShape {
 public:
  AreaShape(const trace::Light& light, uint32_t number, uint64_t seed, double reference);

  bool is_small(const Receiver& receiver) const override;
  Glance glance(const Receiver& receiver, float u, float v) const override;
  bool has_many_parts() const override { return varies_ && triangles_.size() > kManyParts; }
  double by_strata(const Strata& rays) const override;
  std::span<const Vec3f> outline() const override { return outline_; }
  bool is_minor(const Receiver& receiver) const override;
  bool is_major(double open) const override { return !(open < major_); }
  void cast(const Receiver& receiver, Detail detail, Strata& out) const override;
  float near(size_t cells) const override {
    constexpr float kSides = 1.6f;  // of square cells
    return triangles_.size() > 2 ? kSides * kSides * area_ / float(cells) : 0.0f;
  }
  void divide(const Receiver& receiver, const Cells& cells, Strata& out) const override;

 private:
  struct Triangle {
    Vec3f corner, edge_u, edge_v, normal;
    float slack;  // at the place, see lift()
    float brightness;
    // cumulative share of the light's power before this triangle, and its own share
    float before, share;
  };
  /// What open() and searches read of each triangle, as columns: bulbs consist of thousands.
  struct Columns {
    std::vector<float> x, y, z;                       // corner
    std::vector<float> middle_x, middle_y, middle_z;  // from the corner to the centroid
    std::vector<float> normal_x, normal_y, normal_z, longest_squared, before;
    std::vector<float> power;  // area times brightness
    void add(const Triangle& triangle);
  };
  struct Corner {
    Vec3f point, normal;
    float slack;
  };
  static constexpr size_t kManyParts = 64;
  void find_corners(Vec3f centre);
  void find_outline(const Box& bounds);
  double full(const Receiver& receiver) const override;
  double rough(const Receiver& receiver) const override;
  bool may_reach(const Box& points) const override;
  struct Places;
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

  Vec3f centre_;    // of the bounding box
  float radius_;    // half of the box's diagonal
  Vec3f facing_{};  // the normal of a flat light; otherwise zero
  std::vector<Triangle> triangles_;
  Columns columns_;
  std::vector<uint32_t> nearby_;  // by n-th of the area, n triangles: where to begin a search
  std::array<Corner, kCorners> corners_;
  std::vector<Vec3f> outline_;
  bool two_sided_, varies_;  // whether some parts are brighter than others
  float area_;
  double faint_ = 0, minor_ = 0;  // about() of less than these
  double major_ = 0;              // open() of at least this
  uint32_t rows_[2] = {1,
                       1};  // per detail: strata across a triangle; columns run along the triangles
};

}  // namespace deltalux::direct
