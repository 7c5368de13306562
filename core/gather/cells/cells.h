// SPDX-License-Identifier: Apache-2.0
// All cells of a scene: first those of the static geometry, then those of each movable, in the
// order of objects.
#pragma once
#include <algorithm>
#include <deque>
#include <span>

#include "base/assertion.h"
#include "base/parallel.h"
#include "base/transform.h"
#include "gather/cells/body_cells.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// A pure function of the scene's geometry and scene metre; independent of poses.
class Cells {
 public:
  Cells() = default;
  /// `metre`: samples::scene_metre of the scene. Throws SceneError if there are too many cells, and
  /// Cancelled.
  Cells(const scene::Scene& scene, const trace::RayCaster& caster, float metre,
        const Progress& progress = {});
  /// Reduces the areas of cells by what their triangles hide from each other. To be called again
  /// after add_object(). Throws Cancelled: new objects have to be dropped then.
  void expose(const scene::Scene& scene, const trace::RayCaster& caster, const Workers& workers,
              const Progress& progress);
  /// Adds the cells of an object that was added to the scene last. Throws Cancelled, too.
  void add_object(const scene::Scene& scene, uint32_t object, const Progress& progress = {});
  /// Removes the cells of objects from index `count` on.
  void drop_objects(size_t count);

  size_t objects() const { return body_of_.size(); }
  uint32_t size() const { return uint32_t(area_.size()); }
  /// Area in square metres; and the distance below which a hit counts as near, so that the ray
  /// continues as a chain instead of reading this cell.
  float area(uint32_t cell) const {
    DELTALUX_ASSERT(cell < size());
    return area_[cell];
  }
  float near(uint32_t cell) const {
    DELTALUX_ASSERT(cell < size());
    return near_[cell];
  }
  uint32_t material(uint32_t cell) const {
    DELTALUX_ASSERT(cell < size());
    return material_[cell];
  }
  /// The mean reflectance of a cell, whose material is in this state.
  Vec3f reflectance(uint32_t cell, const scene::Material& now) const {
    return surfaces::tinted(now.reflectance, now.contrast(), tint(cell));
  }
  /// The mean of Scene::tint_at() over the cell, by area.
  Vec3f tint(uint32_t cell) const { return tint_.empty() ? Vec3f{1, 1, 1} : tint_[cell]; }
  /// Index of the first cell of a movable, and of the one behind its last.
  std::pair<uint32_t, uint32_t> of_object(uint32_t object) const;
  /// Edge length of the squares of static geometry.
  float edge() const;
  float metre() const { return metre_; }
  /// Calls visit(first cell, object or kNone, its cells) for each body: the static geometry, then
  /// each movable.
  template <class Visit>
  void each_body(const Visit& visit) const {
    for (const Body& body : bodies_) visit(body.first_cell, body.object, body.cells);
  }
  /// Calls visit(cell, ball) for each cell, or only for those of the movables `objects` unless that
  /// is empty. Where rays land in the cell at present, they land in the ball.
  template <class Visit>
  void each_landing(const scene::Scene& scene, std::span<const uint32_t> objects,
                    const Visit& visit) const {
    for (const Body& body : bodies_) {
      if (!objects.empty() &&
          std::find(objects.begin(), objects.end(), body.object) == objects.end())
        continue;
      const Pose pose = body.object != scene::kNone ? scene.objects[body.object].pose : Pose{};
      for (uint32_t own = 0; own < body.cells.size(); ++own) {
        BodyCells::Ball ball = body.cells.ball(own);
        ball.centre = pose.point(ball.centre);
        ball.radius += kAside * position_slack(ball.centre);
        visit(body.first_cell + own, ball);
      }
    }
  }
  size_t bytes() const;

 private:
  friend class CellFinder;
  /// Multiples of position_slack(): how far beside its cell a point may lie.
  static constexpr float kAside = 5;
  /// A rigid body with its cells.
  struct Body {
    uint32_t object;  ///< kNone: the static scene
    uint32_t first_cell, first_primitive;
    BodyCells cells;
    bool exposed = false;  ///< whether expose() has been called
  };
  void add(const scene::Scene& scene, uint32_t object, uint32_t first_primitive,
           std::span<const BodyCells::Triangle> triangles, float edge, const Distance& distance,
           const Progress& progress);

  float metre_ = 1;
  std::deque<Body> bodies_;
  std::vector<uint32_t> body_of_;  // by object: index in bodies_
  std::vector<float> area_, near_;
  std::vector<uint32_t> material_;
  std::vector<Vec3f> tint_;  // empty while all are 1
};

/// Finds cells in the present poses; has to be made anew after each edit.
class CellFinder {
 public:
  CellFinder(const scene::Scene& scene, const Cells& cells);
  /// The cell where a ray from `origin` along `w` lands at distance `t` on `primitive`; kNoCell on
  /// a triangle without area.
  uint32_t find(uint32_t primitive, Vec3f origin, Vec3f w, float t) const;
  /// Fetches what find() reads first, so that a later call needs not wait for memory.
  void prefetch(uint32_t primitive) const {
    if (primitive < scene_.static_primitives()) cells_.bodies_[0].cells.prefetch(primitive);
  }

 private:
  const scene::Scene& scene_;
  const Cells& cells_;
  std::vector<FastTransform> to_local_;  // per object
};

}  // namespace deltalux::gather
