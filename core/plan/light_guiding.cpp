// SPDX-License-Identifier: Apache-2.0
// Finds landings of useful paths, and encloses them in a few balls.
#include "plan/light_guiding.h"

#include <algorithm>
#include <array>
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
constexpr uint32_t kUseful = 8;        // if one in so many of them reaches a place, that is enough
constexpr uint32_t kGlances = 8;       // shadow rays from each vertex of a path followed backwards
constexpr double kDivided = 1.0 / 32;  // what a landing counts in balls that are divided
constexpr size_t kLeast = 64;          // landings for a map
constexpr size_t kFewest = 32;         // of a ball: each landing would deserve one of its own
// What each part of the light seems to gain by a division that happens by chance, per landing.
constexpr double kChance = 0.5;
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

/// Some of the landings: where they lie, and what they bring.
struct Cluster {
  /// Of the light's parts: fewer than in a map, so that few landings tell them apart.
  static constexpr size_t kParts = 16;
  Box box;
  size_t count = 0;
  std::array<double, kParts> use{};  ///< by part

  void add(const Landing& own) {
    box.grow(own.at), ++count;
    use[own.part * kParts / trace::AimMap::kParts] += own.use;
  }
  /// The fewer landings are known, the farther from them others may be.
  float widened(float radius, float margin) const {
    return radius * (1 + 1 / std::sqrt(float(count))) + margin;
  }
  /// Log-likelihood of the landings, times their use, if those of each part are spread evenly over
  /// a surface of the size of their box, or of their ball.
  struct Likelihood {
    double of_box, of_ball;
  };
  Likelihood likelihood(float margin) const {
    const Vec3f half = box.extent() * 0.5f;
    const double x = double(widened(half.x, margin)), y = double(widened(half.y, margin)),
                 z = double(widened(half.z, margin)), r = double(widened(length(half), margin));
    double sum = 0, parts = 0;
    for (const double own : use)
      if (own > 0) sum += own, parts += own * std::log(own);
    parts -= kChance * sum * (kParts - 1) / double(count);
    return {parts - sum * std::log(x * y + y * z + z * x), parts - sum * std::log(r * r)};
  }
};

/// A ball around landings, and where to divide it.
struct Ball {
  size_t begin, end;  ///< of the landings
  trace::AimMap::Target target;
  /// The plane that divides it best, and how much likelier that makes the landings.
  int axis = 0;
  float at = 0;
  double gain = 0;
  bool divided = false;
};

/// Finds the plane across an axis that divides landings best. A small cluster in a wide field gains
/// much by a box of its own, long boxes gain by two balls in place of one, and an even field gains
/// nothing, however wide it is.
void find_division(std::vector<Landing> own, const Cluster& all, float margin, int axis,
                   Ball& ball) {
  std::stable_sort(own.begin(), own.end(),
                   [&](const Landing& p, const Landing& q) { return p.at[axis] < q.at[axis]; });
  std::vector<Cluster::Likelihood> above(own.size());  // of each landing and those behind it
  Cluster part;
  for (size_t i = own.size(); i-- > kFewest;) {
    part.add(own[i]);
    above[i] = part.likelihood(margin);
  }
  part = {};
  const Cluster::Likelihood whole = all.likelihood(margin);
  for (size_t i = 0; i + kFewest <= own.size(); ++i) {
    if (i >= kFewest && own[i - 1].at[axis] < own[i].at[axis]) {
      const Cluster::Likelihood below = part.likelihood(margin);
      const double gain = std::max(below.of_box + above[i].of_box - whole.of_box,
                                   below.of_ball + above[i].of_ball - whole.of_ball);
      if (gain > ball.gain) ball.axis = axis, ball.at = own[i].at[axis], ball.gain = gain;
    }
    part.add(own[i]);
  }
}

Ball ball_of(std::span<const Landing> landings, size_t begin, size_t end, float margin) {
  Cluster all;
  for (size_t i = begin; i < end; ++i) all.add(landings[i]);
  Ball out{begin, end, {all.box.centre(), 0}};
  for (size_t i = begin; i < end; ++i)
    out.target.radius = std::max(out.target.radius, length(landings[i].at - out.target.centre));
  out.target.radius = all.widened(out.target.radius, margin);
  for (int axis = 0; axis < 3; ++axis) {
    const auto own = landings.subspan(begin, end - begin);
    find_division({own.begin(), own.end()}, all, margin, axis, out);
  }
  return out;
}

/// Encloses the landings in balls: divides the one that gains most, and so on. Those that were
/// divided stay, too: what lies between their parts is aimed at, though less.
std::vector<Ball> balls_of(std::vector<Landing>& landings, float margin) {
  std::vector<Ball> balls{ball_of(landings, 0, landings.size(), margin)};
  while (balls.size() + 2 <= trace::AimMap::kMostTargets) {
    const auto best = std::max_element(
        balls.begin(), balls.end(), [](const Ball& a, const Ball& b) { return a.gain < b.gain; });
    if (!(best->gain > 0)) break;
    const auto first = landings.begin();
    const auto cut = size_t(
        std::stable_partition(first + long(best->begin), first + long(best->end),
                              [&](const Landing& own) { return own.at[best->axis] < best->at; }) -
        first);
    best->gain = 0, best->divided = true;
    const size_t begin = best->begin, end = best->end;
    balls.push_back(ball_of(landings, begin, cut, margin));
    balls.push_back(ball_of(landings, cut, end, margin));
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
    const double counts = balls[k].divided ? kDivided : 1;
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
  return light.on && light.bounds.diagonal() > kLarge * metre;
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
  const std::unique_ptr<const direct::LightShape> shape = direct::shape_of(light, 0, kSeed);
  const double strength = photopic(Vec3d(light.strength));
  std::vector<std::vector<Landing>> found(pilot.points());
  workers.for_blocks(found.size(), 64, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      add_landings(pilot, *shape, strength, i, weight[i], found[i]);
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
