// SPDX-License-Identifier: Apache-2.0
// Chooses methods: predicts how many segments the bake and the frames of a session bring to each
// part.
#include <algorithm>
#include <set>

#include "session/discs/disc_layer.h"
#include "session/discs/feed.h"

namespace deltalux::session {
namespace {

using plan::Traffic;

/// The size of a set of points: radius of the sphere around the middle of its bounding box, and the
/// box's diagonal.
struct Extent {
  double radius = 0, diagonal = 0;

  explicit Extent(std::span<const Vec3f> points) {
    if (points.empty()) return;
    Box box;
    for (const Vec3f& p : points) box.grow(p);
    const Vec3f middle = (box.low + box.high) * 0.5f;
    for (const Vec3f& p : points) radius = std::max(radius, double(length(p - middle)));
    diagonal = double(length(box.extent()));
  }
};

std::vector<Vec3f> all_vertices(const scene::Scene& scene) {
  std::vector<Vec3f> all;
  for (const scene::Object& object : scene.objects) {
    const std::vector<Vec3f> own = object.world_vertices();
    all.insert(all.end(), own.begin(), own.end());
  }
  return all;
}

/// Predicts from pilot paths the segments that each part's estimator will process.
class TrafficForecast {
 public:
  TrafficForecast(const World& world, const PilotPaths& paths)
      : world_(world), paths_(paths), scene_(all_vertices(world.scene)) {
    // With several threads, methods that collect segments get those of each slab separately.
    slabs_ = world_.workers.threads() > 1 ? double(world_.slabs()) : 1.0;
    for (const scene::Object& object : world_.scene.objects) movables_ += object.movable;
  }

  Traffic of_static() const {
    Traffic traffic = empty();
    double affected = 0;
    std::vector<uint8_t> cut(world_.scene.objects.size());
    for (const PilotFlight& flight : paths_.flights) {
      if (flight.bounce == 0) std::ranges::fill(cut, uint8_t(0));
      const uint32_t object = object_of(flight);
      if (object != scene::kNone && world_.scene.objects[object].movable) cut[object] = 1;
      if (!counts(flight)) continue;
      traffic.sample.add(flight.origin, flight.direction, flight.length, flight.extended);
      affected += double(std::ranges::count(cut, uint8_t(1)));
    }
    traffic.removed = 1;
    set_loads(traffic, movables_ ? affected / double(movables_) * paths_.weight() : 0.0,
              double(kMaxPerStep));
    return traffic;
  }

  Traffic of_moving(const MovingPart& part) const {
    Traffic traffic = empty();
    traffic.moving = true;
    const scene::Object& object = world_.scene.objects[part.object];
    const FastTransform to_local(object.pose.inverse());
    for (const PilotFlight& flight : paths_.flights) {
      if (!counts(flight)) continue;
      const SlabRay ray(flight.origin, flight.direction);
      if (ray.entry(part.world, flight.extended) > flight.extended) continue;
      traffic.sample.add(to_local.point(flight.origin), to_local.direction(flight.direction),
                         flight.length, flight.extended);
    }
    // When an object moves, its part is summed anew from all segments near it, at once.
    const double all = double(traffic.sample.count()) * paths_.weight();
    set_loads(traffic, all, double(paths_.held));
    const Extent own(object.world_vertices());
    traffic.size_by_sphere = own.radius / std::max(1e-30, scene_.radius);
    traffic.size_by_box = own.diagonal / std::max(1e-30, scene_.diagonal);
    return traffic;
  }

 private:
  Traffic empty() const {
    Traffic traffic;
    traffic.frames = movables_ ? world_.options.expected_frames : 0.0;
    traffic.rebuilds = world_.options.rebuilds;
    return traffic;
  }
  bool counts(const PilotFlight& flight) const {
    return flight.bounce > 0 || !world_.light_sampled[flight.light];
  }
  uint32_t object_of(const PilotFlight& flight) const {
    return flight.primitive == scene::kNone ? scene::kNone
                                            : world_.scene.object_of(flight.primitive);
  }
  /// Sets the loads of bake and frame. `step`: number of paths after which a frame passes on the
  /// segments it collected.
  void set_loads(Traffic& traffic, double frame, double step) const {
    const double bake = double(traffic.sample.count()) * paths_.weight();
    const double paths = std::max(1.0, double(paths_.held));
    const auto span = [&](double segments, double per_step) {
      const double collected = segments * std::min(1.0, per_step / paths);
      return std::max(1.0, std::min(collected, double(kPortion)) / slabs_);
    };
    traffic.bake = {bake, span(bake, double(kPathsPerStep))};
    traffic.frame = {frame, span(frame, step)};
  }

  const World& world_;
  const PilotPaths& paths_;
  const Extent scene_;
  double slabs_ = 1;
  size_t movables_ = 0;
};

}  // namespace

void DiscLayer::plan(PlacedDiscs& placed, const PilotPaths& paths, bool thorough,
                     Progress& progress) {
  progress.begin("plan", 1);
  plans.clear();
  if (placed.pilots.empty()) {
    const auto without_discs = [&](uint32_t object, Method asked) {
      plan::PartPlan& plan = plans.emplace_back();
      plan.object = object;
      plan.chosen = asked == Method::automatic ? Method::disc_index : asked;
    };
    without_discs(scene::kNone, world.options.static_method);
    const std::set<uint32_t> carriers(world.samples.attached.begin(), world.samples.attached.end());
    for (const uint32_t object : carriers)
      if (object != scene::kNone) without_discs(object, world.options.moving_method);
    return;
  }
  const TrafficForecast forecast(world, paths);
  const auto plan_one = [&](plan::Pilot& pilot, uint32_t object, Method asked, auto&& traffic) {
    plan::PartPlan plan;
    plan.chosen = asked;
    plan.discs = double(pilot.discs().size());
    if (thorough || asked == Method::automatic)
      plan = plan::plan_part(pilot, traffic(), world.options.policy, world.options.machine,
                             thorough, &progress);
    if (asked != Method::automatic) plan.chosen = asked;
    plan.object = object;
    plans.push_back(std::move(plan));
  };
  plan_one(placed.pilots[0], scene::kNone, world.options.static_method,
           [&] { return forecast.of_static(); });
  for (size_t i = 0; i < moving.size(); ++i) {
    place_part(moving[i]);
    plan_one(placed.pilots[i + 1], moving[i].object, world.options.moving_method,
             [&] { return forecast.of_moving(moving[i]); });
  }
}

}  // namespace deltalux::session
