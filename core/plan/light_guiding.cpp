// SPDX-License-Identifier: Apache-2.0
// Finds landings of useful paths, and encloses them in a few balls.
#include "plan/light_guiding.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "base/random.h"
#include "direct/light_shape.h"
#include "trace/scatter.h"

namespace deltalux::plan {
namespace {

constexpr uint64_t kSeed = 20261128;
constexpr uint64_t kFirstPath = uint64_t(1) << 25;  // different from those of suns
constexpr float kLarge = 8;                         // least diagonal of the light, in scene metres
constexpr uint32_t kEven = 2048;                    // paths that are not aimed
constexpr uint32_t kUseful = 8;    // if one in so many of them reaches a place, that is enough
constexpr uint32_t kWalks = 4;     // from each place of the pilot
constexpr uint32_t kBack = 3;      // flights of such a walk
constexpr uint32_t kGlances = 2;   // shadow rays from each of its vertices
constexpr size_t kLeast = 64;      // landings for a map
constexpr float kMargin = 0.5f;    // radii of a disc: how much balls exceed the landings
constexpr uint32_t kAgain = 8192;  // paths that try the map
constexpr double kWorth = 1.5;     // smallest reduction of variance for which a map is used
// Shares of the chances: of pairs as they were found; of parts and targets each by itself; and of
// targets with any part.
constexpr double kJoint = 0.5, kApart = 0.25;

/// A place where a useful path of the light lands.
struct Landing {
  Vec3f at;
  uint32_t part;  ///< of the light, where the path starts
  double use;     ///< light that it brings to the pilot's places, relative to what they have
};

/// Follows light paths backwards from a place, and asks for the light at each vertex.
void add_landings(const LightPilot& pilot, const direct::LightShape& shape, double strength,
                  size_t place, double weight, std::vector<Landing>& out) {
  const samples::SampleSet& places = pilot.places();
  const Vec3f n = places.normal[place];
  const Vec3f above = places.point[place] + n * (places.radius[place] * 0.01f);
  for (uint32_t walk = 0; walk < kWalks; ++walk) {
    const PathRandom random(kSeed + walk, place);
    Vec3f at = above, normal = n;
    double share = weight * strength;
    for (uint32_t flight = 0; flight < kBack && share > 0; ++flight) {
      const Vec3f w = cosine_direction(normal, random(flight, 0), random(flight, 1));
      const trace::Hit hit = pilot.caster().closest_static(at, w);
      if (!hit.valid()) break;
      normal = trace::facing_normal(hit, w);
      at = trace::leave_surface(at, w, hit, normal, pilot.scene().slack_of(hit.primitive));
      share *= photopic(Vec3d(pilot.scene().material_of(hit.primitive).reflectance));
      const direct::Receiver receiver{at, normal};
      for (uint32_t k = 0; k < kGlances; ++k) {
        const float u = random(flight, 2 + 2 * k), v = random(flight, 3 + 2 * k);
        const direct::LightShape::Glance ray = shape.glance(receiver, u, v);
        if (!(ray.irradiance > 0) ||
            pilot.caster().occluded_static(ray.origin, ray.direction, ray.to))
          continue;
        const auto part = std::min(uint32_t(u * trace::AimMap::kParts), trace::AimMap::kParts - 1);
        out.push_back({at, part, share * ray.irradiance / kGlances});
      }
    }
  }
}

/// A ball around some of the landings.
struct Ball {
  size_t begin, end;  ///< of the landings
  trace::AimMap::Target target;
  double use;
  /// How much it gains from being divided.
  double wide() const { return use * double(target.radius) * double(target.radius); }
};

Ball ball_of(std::span<const Landing> landings, size_t begin, size_t end, float margin) {
  Box box;
  Ball out{begin, end, {}, 0};
  for (size_t i = begin; i < end; ++i) box.grow(landings[i].at), out.use += landings[i].use;
  out.target.centre = box.centre();
  for (size_t i = begin; i < end; ++i)
    out.target.radius = std::max(out.target.radius, length(landings[i].at - out.target.centre));
  out.target.radius += margin;
  return out;
}

/// Encloses the landings in balls: divides the one that gains most at the middle of its longest
/// extent.
std::vector<Ball> balls_of(std::vector<Landing>& landings, float margin) {
  std::vector<Ball> balls{ball_of(landings, 0, landings.size(), margin)};
  while (balls.size() < trace::AimMap::kMostTargets) {
    const auto widest =
        std::max_element(balls.begin(), balls.end(),
                         [](const Ball& a, const Ball& b) { return a.wide() < b.wide(); });
    Box box;
    for (size_t i = widest->begin; i < widest->end; ++i) box.grow(landings[i].at);
    const Vec3f extent = box.extent(), middle = box.centre();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0
                     : extent.y >= extent.z                       ? 1
                                                                  : 2;
    const auto first = landings.begin();
    const auto cut = size_t(
        std::stable_partition(first + long(widest->begin), first + long(widest->end),
                              [&](const Landing& own) { return own.at[axis] < middle[axis]; }) -
        first);
    if (cut == widest->begin || cut == widest->end) break;
    const Ball other = ball_of(landings, cut, widest->end, margin);
    *widest = ball_of(landings, widest->begin, cut, margin);
    balls.push_back(other);
  }
  return balls;
}

trace::AimMap map_of(std::vector<Landing>& landings, float margin) {
  constexpr size_t kParts = trace::AimMap::kParts;
  const std::vector<Ball> balls = balls_of(landings, margin);
  trace::AimMap map;
  std::vector<double> joint(kParts * balls.size()), part(kParts), target(balls.size());
  double all = 0;
  for (size_t k = 0; k < balls.size(); ++k) {
    map.targets.push_back(balls[k].target);
    for (size_t i = balls[k].begin; i < balls[k].end; ++i) {
      const Landing& own = landings[i];
      joint[own.part * balls.size() + k] += own.use;
      part[own.part] += own.use, target[k] += own.use, all += own.use;
    }
  }
  double sum = 0;
  for (size_t p = 0; p < kParts; ++p)
    for (size_t k = 0; k < balls.size(); ++k) {
      constexpr double kSteps = double(trace::AimMap::kSteps);
      map.below.push_back(float(std::min(std::floor(sum * kSteps), kSteps - 1) / kSteps));
      sum += (kJoint * joint[p * balls.size() + k] +
              target[k] * (kApart * part[p] / all + (1 - kJoint - kApart) / double(kParts))) /
             all;
    }
  return map;
}

/// Mean squares of what one path brings, if its light were aimed, and if it were not.
struct Variance {
  double aimed = 0, even = 0;
};

Variance variance_of(const LightPilot& pilot, const trace::Light& light,
                     std::span<const double> weight, const Workers& workers,
                     const Progress& progress) {
  std::vector<Variance> found((kAgain + LightPilot::kChunk - 1) / LightPilot::kChunk);
  workers.for_blocks(kAgain, LightPilot::kChunk, [&](size_t begin, size_t end) {
    progress.check();
    std::vector<trace::Emission> starts;
    for (size_t i = begin; i < end; ++i) starts.push_back(trace::emit(light, kSeed, i, 1));
    double brought[LightPilot::kChunk];
    pilot.brought(light, starts, kFirstPath + begin, weight, brought);
    Variance& own = found[begin / LightPilot::kChunk];
    for (size_t k = 0; k < starts.size(); ++k) {
      const double square = brought[k] * brought[k];
      own.aimed += square;
      if (starts[k].weight > 0) own.even += square / double(starts[k].weight);
    }
  });
  Variance sum;
  for (const Variance& own : found) sum.aimed += own.aimed, sum.even += own.even;
  return sum;
}

/// Whether many paths that are not aimed are useful.
bool suffices(const LightPilot& pilot, const trace::Light& light, std::span<const double> weight,
              const Workers& workers, const Progress& progress) {
  std::vector<uint32_t> useful(kEven / LightPilot::kChunk);
  workers.for_blocks(kEven, LightPilot::kChunk, [&](size_t begin, size_t end) {
    progress.check();
    std::vector<trace::Emission> starts;
    for (size_t i = begin; i < end; ++i) starts.push_back(trace::emit(light, kSeed, i, 1));
    double brought[LightPilot::kChunk];
    pilot.brought(light, starts, kFirstPath + kAgain + begin, weight, brought);
    for (size_t k = 0; k < starts.size(); ++k) useful[begin / LightPilot::kChunk] += brought[k] > 0;
  });
  return std::accumulate(useful.begin(), useful.end(), 0u) * kUseful >= kEven;
}

}  // namespace

bool may_be_aimed(const trace::Light& light, float metre) {
  return light.is_area() && light.on && light.bounds.diagonal() > kLarge * metre;
}

std::shared_ptr<const trace::AimMap> aim_light(const LightPilot& pilot, const trace::Light& given,
                                               std::span<const double> weight,
                                               const Workers& workers, Progress& progress) {
  trace::Light light = given;
  light.aims = nullptr;
  light.path_count = kAgain;
  progress.begin("find what large lights light", 1);
  if (suffices(pilot, light, weight, workers, progress)) return nullptr;
  const direct::LightShape shape(light, 0, kSeed);
  const double strength = photopic(Vec3d(light.radiance));
  std::vector<std::vector<Landing>> found(pilot.points());
  workers.for_blocks(found.size(), 64, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      add_landings(pilot, shape, strength, i, weight[i], found[i]);
  });
  std::vector<Landing> landings;
  for (const auto& own : found) landings.insert(landings.end(), own.begin(), own.end());
  if (landings.size() < kLeast) return nullptr;
  const float margin = kMargin * pilot.places().radius.front();
  auto map = std::make_shared<trace::AimMap>(map_of(landings, margin));
  if (map->flaw()) return nullptr;
  light.aims = map;
  const Variance variance = variance_of(pilot, light, weight, workers, progress);
  progress.advance(1);
  return variance.even > kWorth * variance.aimed ? map : nullptr;
}

}  // namespace deltalux::plan
