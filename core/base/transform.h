// SPDX-License-Identifier: Apache-2.0
// Rigid transforms (poses): local to world, column vectors.
#pragma once
#include "base/vec.h"

namespace deltalux {

struct Pose {
  // Rows of the rotation, and the translation; in double precision, so that poses survive a round
  // trip.
  Vec3d row[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Vec3d translation{};

  Vec3f point(Vec3f p) const {
    const Vec3d q(p);
    return Vec3f(Vec3d{dot(row[0], q), dot(row[1], q), dot(row[2], q)} + translation);
  }
  Vec3f direction(Vec3d q) const {
    return Vec3f(Vec3d{dot(row[0], q), dot(row[1], q), dot(row[2], q)});
  }
  Vec3f direction(Vec3f p) const { return direction(Vec3d(p)); }
  /// Bounds of a transformed box.
  Box box(const Box& local) const {
    Box out;
    for (int i = 0; i < 8 && !local.empty(); ++i)
      out.grow(point({i & 1 ? local.high.x : local.low.x, i & 2 ? local.high.y : local.low.y,
                      i & 4 ? local.high.z : local.low.z}));
    return out;
  }
  Pose inverse() const {
    Pose r;
    for (int i = 0; i < 3; ++i) r.row[i] = {row[0][i], row[1][i], row[2][i]};
    const Vec3d t = translation;
    r.translation = -Vec3d{dot(r.row[0], t), dot(r.row[1], t), dot(r.row[2], t)};
    return r;
  }
  friend bool operator==(const Pose&, const Pose&) = default;
};

/// The same in single precision, for transforming segments to object space; one definition for all
/// users.
struct FastTransform {
  Vec3f row[3];
  Vec3f translation;

  explicit FastTransform(const Pose& p)
      : row{Vec3f(p.row[0]), Vec3f(p.row[1]), Vec3f(p.row[2])}, translation(p.translation) {}
  Vec3f point(Vec3f p) const { return direction(p) + translation; }
  Vec3f direction(Vec3f p) const { return {dot(row[0], p), dot(row[1], p), dot(row[2], p)}; }
};

}  // namespace deltalux
