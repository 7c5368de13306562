// SPDX-License-Identifier: Apache-2.0
// Tests a few probes per cell along the cell's normal.
#include "gather/cells/coverage.h"

#include <algorithm>
#include <bit>
#include <mutex>
#include <optional>

namespace deltalux::gather {
namespace {

// In units of a square's edge: anything closer covers the probe.
constexpr float kContact = 0.05f;
// In units of position_slack(): less than the leads of two bodies differ by, see RayCaster.
constexpr float kTie = 0x1p-5f;
constexpr size_t kGrain = 256;
constexpr float kFar = std::numeric_limits<float>::infinity();

/// Caches whether static objects are closed, and their bounding boxes, computed on first use.
class Bodies {
 public:
  explicit Bodies(const scene::Scene& scene)
      : scene_(scene), closed_(scene.objects.size()), bounds_(scene.objects.size()) {}
  bool closed(uint32_t object) {
    const std::lock_guard lock(mutex_);
    std::optional<bool>& own = closed_[object];
    if (!own) own = scene::is_closed(scene_.objects[object]);
    return *own;
  }
  Box bounds(uint32_t object) {
    const std::lock_guard lock(mutex_);
    std::optional<Box>& own = bounds_[object];
    if (own) return *own;
    own.emplace();
    for (const Vec3f& v : scene_.objects[object].vertices)
      own->grow(scene_.objects[object].pose.point(v));
    return *own;
  }

 private:
  const scene::Scene& scene_;
  std::mutex mutex_;
  std::vector<std::optional<bool>> closed_;
  std::vector<std::optional<Box>> bounds_;
};

/// Tests whether probes are covered.
class Prober {
 public:
  Prober(const scene::Scene& scene, const trace::RayCaster& caster, const Cells& cells)
      : scene_(scene), caster_(caster), bodies_(scene), contact_(kContact * cells.edge()) {}

  /// Whether the static scene covers a probe: something touches it, or it lies inside of a closed
  /// object from which the probe's own object sticks out (`object`, or the one found `lift` below
  /// the probe). A closed object that contains the probe's whole object does not cover it: it is a
  /// room whose triangles are wound outward, or nobody sees its contents.
  bool by_static(Vec3f o, Vec3f n, uint32_t object, float lift) {
    const trace::Hit hit = caster_.closest_static(o, n);
    if (!hit.valid()) return false;
    if (hit.t < contact_) return true;
    const uint32_t around = scene_.object_of(hit.primitive);
    if (!(dot(hit.normal, n) > 0) || !bodies_.closed(around)) return false;
    if (object == scene::kNone) {
      const trace::Hit under = caster_.closest_static(o, -n, 0, 2 * lift);
      if (!under.valid()) return true;
      object = scene_.object_of(under.primitive);
    }
    if (object == around) return false;
    return !bodies_.bounds(around).padded(contact_).contains(bodies_.bounds(object));
  }
  /// Whether a body (kNone: the static scene) lies on the surface at `p` of another one, less than
  /// `lift` above it. Of two in one plane, it is the one that rays hit.
  bool lies_on(uint32_t body, uint32_t below, Vec3f p, Vec3f n, float lift) const {
    const float slack = position_slack(p);
    const float ahead = trace::RayCaster::lead(below) - trace::RayCaster::lead(body);
    const float above = (ahead + (ahead != 0 || body > below ? kTie : -kTie)) * slack;
    const Vec3f from = p + n * above;
    return (body == scene::kNone ? caster_.closest_static(from, n, 0, lift - above)
                                 : caster_.closest_object(body, from, n, 0, lift - above))
        .valid();
  }
  /// Whether a movable object touches or contains the probe.
  bool by_object(uint32_t object, Vec3f o, Vec3f n) const {
    if (caster_.closest_object(object, o, n, 0, contact_).valid()) return true;
    thread_local std::vector<trace::Stretch> inside;
    inside.clear();
    caster_.add_inside(object, o, n, contact_, inside);
    return !inside.empty();
  }
  float contact() const { return contact_; }

 private:
  const scene::Scene& scene_;
  const trace::RayCaster& caster_;
  Bodies bodies_;
  float contact_;
};

}  // namespace

float Coverage::bare(uint32_t cell) const {
  const int bare = int(BodyCells::kProbes) - std::popcount(covered_[cell]);
  return std::max(float(bare) / BodyCells::kProbes, 0.25f);
}

void Coverage::compute(const scene::Scene& scene, const trace::RayCaster& caster,
                       const Cells& cells, const Workers& workers) {
  fixed_.clear(), covered_.clear(), reach_.clear();
  trace::Change all;
  for (uint32_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].movable) all.objects.push_back({i, {}, {}});
  for (trace::MovedObject& moved : all.objects)
    if (const Box& box = caster.object_bounds(moved.object); !box.empty())
      moved.passed = {box}, moved.now = box;
  update(scene, caster, cells, all, workers);
}

void Coverage::update(const scene::Scene& scene, const trace::RayCaster& caster, const Cells& cells,
                      const trace::Change& change, const Workers& workers) {
  const size_t known = fixed_.size();
  fixed_.resize(cells.size(), 0), covered_.resize(cells.size(), 0);
  reach_.resize(cells.size());
  Prober prober(scene, caster, cells);
  const trace::ChangeTest test(change, {}, 0);
  cells.each_body([&](uint32_t first, uint32_t object, const BodyCells& body) {
    const bool moves = object != scene::kNone;
    const bool gone = moves && !scene.objects[object].present;
    const bool changed = moves && test.moves(object);
    const Pose pose = moves ? scene.objects[object].pose : Pose{};
    workers.for_blocks(body.size(), kGrain, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const uint32_t own = uint32_t(i), cell = first + own;
        if (!body.has_probes(own)) continue;
        if (gone) {
          covered_[cell] = 0;
          continue;
        }
        if (!moves && cell < known && !test.touches(reach_[cell])) continue;
        const Vec3f n = pose.direction(body.normal(own));
        Vec3f foot[BodyCells::kProbes], at[BodyCells::kProbes];
        float lift = 0;
        Box reach;
        for (uint32_t k = 0; k < BodyCells::kProbes; ++k) {
          const Vec3f p = foot[k] = pose.point(body.probe(own, k));
          at[k] = p + n * (lift = 4 * position_slack(p) + body.rise());
          reach.grow(p), reach.grow(at[k]), reach.grow(at[k] + n * prober.contact());
        }
        reach_[cell] = reach;
        const bool fresh = changed || cell >= known;
        if (fresh) {
          fixed_[cell] = 0;
          for (uint32_t k = 0; k < BodyCells::kProbes; ++k)
            if ((moves && prober.lies_on(scene::kNone, object, foot[k], n, lift)) ||
                prober.by_static(at[k], n, object, lift))
              fixed_[cell] |= uint16_t(1u << k);
        }
        if (!fresh && !test.touches(reach)) continue;
        covered_[cell] = fixed_[cell];
        for (uint32_t other : caster.present()) {
          if (!caster.object_bounds(other).overlaps(reach)) continue;
          for (uint32_t k = 0; k < BodyCells::kProbes; ++k)
            if (!(covered_[cell] >> k & 1) &&
                ((other != object && prober.lies_on(other, object, foot[k], n, lift)) ||
                 prober.by_object(other, at[k], n)))
              covered_[cell] |= uint16_t(1u << k);
        }
      }
    });
  });
}

}  // namespace deltalux::gather
