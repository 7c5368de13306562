// SPDX-License-Identifier: Apache-2.0
// Finds landings of useful paths, and encloses them in a few balls.
#include "plan/light_guiding.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "direct/light_shape.h"

namespace deltalux::plan {
namespace {

constexpr uint64_t kSeed = 20261128;
constexpr uint64_t kFirstPath = uint64_t(1) << 25;  // different from those of suns
constexpr float kLarge = 8;                         // least diagonal of the light, in scene metres
constexpr uint32_t kEven = 2048;                    // paths that are not aimed
constexpr uint32_t kUseful = 8;    // if one in so many of them reaches a place, that is enough
constexpr uint32_t kGlances = 8;   // shadow rays from each vertex of a path followed backwards
constexpr double kWhole = 0.0625;  // what a landing counts in the ball of all, relative to its own
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
  double share = 0;
  pilot.follow_back(
      place, kSeed,
      [&](Vec3f at, Vec3f normal, uint32_t primitive, uint32_t flight, const PathRandom& random) {
        if (flight == 0) share = weight * strength;
        share *= photopic(Vec3d(pilot.scene().material_of(primitive).reflectance));
        for (uint32_t k = 0; k < kGlances && share > 0; ++k) {
          const float u = random(flight, 2 + 2 * k), v = random(flight, 3 + 2 * k);
          const direct::LightShape::Glance ray = shape.glance({at, normal}, u, v);
          if (!(ray.irradiance > 0) ||
              pilot.caster().occluded_static(ray.origin, ray.direction, ray.to))
            continue;
          const auto part =
              std::min(uint32_t(u * trace::AimMap::kParts), trace::AimMap::kParts - 1);
          out.push_back({at, part, share * ray.irradiance / kGlances});
        }
      });
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
  // The fewer landings are known, the farther from them others may be.
  out.target.radius *= 1 + 1 / std::sqrt(float(end - begin));
  out.target.radius += margin;
  return out;
}

/// Encloses the landings in balls: divides the one that gains most at the middle of its longest
/// extent. The last ball holds all: what lies between the others is aimed at, too.
std::vector<Ball> balls_of(std::vector<Landing>& landings, float margin) {
  const Ball whole = ball_of(landings, 0, landings.size(), margin);
  std::vector<Ball> balls{whole};
  while (balls.size() < trace::AimMap::kMostTargets - 1) {
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
  balls.push_back(whole);
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
    const double counts = k + 1 < balls.size() ? 1 : kWhole;
    for (size_t i = balls[k].begin; i < balls[k].end; ++i) {
      const double use = landings[i].use * counts;
      joint[landings[i].part * balls.size() + k] += use;
      part[landings[i].part] += use, target[k] += use, all += use;
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

/// What one path of the light brings to the pilot's places, and its weight.
struct Trial {
  double brought;
  float weight;
};

/// Traces `count` paths with numbers from `first` on.
std::vector<Trial> trials_of(const LightPilot& pilot, const trace::Light& light, uint32_t count,
                             uint64_t first, std::span<const double> weight, const Workers& workers,
                             const Progress& progress) {
  std::vector<Trial> trials(count);
  workers.for_blocks(count, LightPilot::kChunk, [&](size_t begin, size_t end) {
    progress.check();
    std::vector<trace::Emission> starts;
    for (size_t i = begin; i < end; ++i) starts.push_back(trace::emit(light, kSeed, i, 1));
    double brought[LightPilot::kChunk];
    pilot.brought(light, starts, first + begin, weight, brought);
    for (size_t i = begin; i < end; ++i) trials[i] = {brought[i - begin], starts[i - begin].weight};
  });
  return trials;
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
  const auto tried = [&](uint32_t count, uint64_t first) {
    return trials_of(pilot, light, count, first, weight, workers, progress);
  };
  const std::vector<Trial> evenly = tried(kEven, kFirstPath + kAgain);
  const auto useful =
      std::count_if(evenly.begin(), evenly.end(), [](const Trial& own) { return own.brought > 0; });
  if (uint64_t(useful) * kUseful >= kEven) return nullptr;
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
  // Mean squares of what a path brings: if the light is aimed, and if it were not.
  double aimed = 0, even = 0;
  for (const Trial& own : tried(kAgain, kFirstPath)) {
    const double square = own.brought * own.brought;
    aimed += square;
    if (own.weight > 0) even += square / double(own.weight);
  }
  progress.advance(1);
  return even > kWorth * aimed ? map : nullptr;
}

}  // namespace deltalux::plan
