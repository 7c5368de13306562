// SPDX-License-Identifier: Apache-2.0
// Traces pilot paths from uniform starts and from starts towards what the sun sees, and builds a
// quadtree over them.
#include "plan/sun_guiding.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::plan {
namespace {

constexpr uint64_t kSeed = 20261124;
constexpr uint64_t kFirstPath = uint64_t(1) << 24;  // different from those of LightPilot::given()
constexpr uint32_t kEven = 16384;                   // uniform starts
constexpr uint32_t kPoints = 32768;                 // points of surfaces that may see the sun
constexpr size_t kSplit = 16;                       // squares with this many starts are divided
constexpr int kDeepest = 14;       // levels: a thousand metres become six centimetres
constexpr double kPrior = 2;       // weight of the parent square's value, in starts
constexpr double kBeside = 0.2;    // relative to a trial's value: what the squares around it get
constexpr int kRounds = 3;         // of further starts, drawn by what earlier ones have found
constexpr uint32_t kAgain = 8192;  // starts per round
constexpr double kWorth = 1.5;     // smallest reduction of variance for which a map is used

/// A pilot path of a sun.
struct Trial {
  float u, v;
  double square;   ///< square of what its path contributes
  float size = 1;  ///< of the square that contains it
};

/// Uniform starts, then starts of paths that end on what the sun sees.
std::vector<Trial> first_starts(const LightPilot& pilot, const lights::Punctual& light,
                                const Workers& workers) {
  std::vector<Trial> trials;
  for (uint32_t i = 0; i < kEven; ++i) {
    const auto r = sobol::sample(i, kSeed);
    trials.push_back({r[0], r[1], 0});
  }
  const samples::SampleSet points = surface_points(pilot.scene(), pilot.caster(), kPoints);
  std::vector<std::array<float, 2>> seen(points.size(), {-1, -1});
  workers.for_blocks(points.size(), 256, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Vec3f n =
          dot(points.normal[i], light.direction) < 0 ? points.normal[i] : -points.normal[i];
      const Vec3f p = points.point[i] + n * (points.radius[i] * 0.01f);
      if (pilot.caster().occluded_static(p, -light.direction, std::numeric_limits<float>::max()))
        continue;
      const Vec3f d = p - light.corner;
      seen[i] = {dot(d, light.frame_u) / dot(light.frame_u, light.frame_u),
                 dot(d, light.frame_v) / dot(light.frame_v, light.frame_v)};
    }
  });
  for (const auto& [u, v] : seen)
    if (u >= 0 && u < 1 && v >= 0 && v < 1) trials.push_back({u, v, 0});
  return trials;
}

/// Traces the trials from index `from` on.
void follow(const LightPilot& pilot, const trace::Light& sun, std::span<const double> weight,
            size_t from, std::vector<Trial>& trials, const Workers& workers, Progress& progress) {
  workers.for_blocks(trials.size() - from, LightPilot::kChunk, [&](size_t begin, size_t end) {
    progress.check();
    std::vector<trace::Emission> starts;
    for (size_t i = from + begin; i < from + end; ++i)
      starts.push_back(trace::emit_from(sun.punctual, {trials[i].u, trials[i].v, 0, 0}));
    double brought[LightPilot::kChunk];
    pilot.brought(sun, starts, kFirstPath + from + begin, weight, brought);
    for (size_t i = begin; i < end; ++i)
      trials[from + i].square = brought[i - begin] * brought[i - begin];
  });
  progress.advance(1);
}

struct Square {
  float u, v, size;
  double square;  ///< mean over trials in it and, with less weight, around it
};

/// Divides the square recursively; [begin, end) are the trials in it.
void divide(std::vector<Trial>& trials, size_t begin, size_t end, Square square, int depth,
            std::vector<Square>& out) {
  double sum = kPrior * square.square;
  for (size_t i = begin; i < end; ++i) sum += trials[i].square;
  square.square = sum / (kPrior + double(end - begin));
  if (end - begin < kSplit || depth == kDeepest) {
    for (size_t i = begin; i < end; ++i) trials[i].size = square.size;
    out.push_back(square);
    return;
  }
  const float half = 0.5f * square.size;
  const auto first = trials.begin();
  const auto part = [&](size_t from, size_t to, auto axis, float at) {
    return size_t(std::partition(first + long(from), first + long(to),
                                 [&](const Trial& trial) { return trial.*axis < at; }) -
                  first);
  };
  const size_t middle = part(begin, end, &Trial::v, square.v + half);
  const size_t low = part(begin, middle, &Trial::u, square.u + half);
  const size_t high = part(middle, end, &Trial::u, square.u + half);
  const auto child = [&](size_t from, size_t to, float du, float dv) {
    divide(trials, from, to, {square.u + du, square.v + dv, half, square.square}, depth + 1, out);
  };
  child(begin, low, 0, 0);
  child(low, middle, half, 0);
  child(middle, high, 0, half);
  child(high, end, half, half);
}

double area(const Square& s) { return double(s.size) * double(s.size); }

double mean_square(const std::vector<Trial>& trials) {
  double sum = 0;
  for (const Trial& trial : trials) sum += trial.square;
  return sum / double(trials.size());
}

/// Adds trials around bright ones. Parts of a window may extend into squares where no trial hit it;
/// a path that starts there would have hundreds of times the weight of its neighbours.
void add_surroundings(std::vector<Trial>& trials) {
  const double mean = mean_square(trials);
  const size_t count = trials.size();
  for (size_t i = 0; i < count; ++i) {
    const Trial own = trials[i];
    if (!(own.square > mean)) continue;
    for (int dv = -1; dv <= 1; ++dv)
      for (int du = -1; du <= 1; ++du) {
        const float u = own.u + float(du) * own.size, v = own.v + float(dv) * own.size;
        if ((du || dv) && u >= 0 && u < 1 && v >= 0 && v < 1)
          trials.push_back({u, v, kBeside * own.square});
      }
  }
}

std::vector<Square> squares_of(std::vector<Trial>& trials) {
  const double mean = mean_square(trials);
  std::vector<Square> squares;
  if (mean > 0) divide(trials, 0, trials.size(), {0, 0, 1, mean}, 0, squares);
  return squares;
}

trace::SunMap map_of(const std::vector<Square>& squares) {
  double all = 0, below = 0;
  for (const Square& s : squares) all += area(s) * std::sqrt(s.square);
  constexpr double kMinDensity = double(trace::SunMap::kMinDensity);
  trace::SunMap map;
  for (const Square& s : squares) {
    map.leaves.push_back({s.u, s.v, s.size, float(below)});
    below += area(s) * (kMinDensity + (1 - kMinDensity) * std::sqrt(s.square) / all);
  }
  return map;
}

}  // namespace

std::shared_ptr<const trace::SunMap> guide_sun(const LightPilot& pilot, const trace::Light& light,
                                               std::span<const double> weight,
                                               const Workers& workers, Progress& progress) {
  trace::Light sun = light;
  sun.map = nullptr;
  sun.path_count = 1;
  progress.begin("find windows", 1 + kRounds);
  std::vector<Trial> trials = first_starts(pilot, sun.punctual, workers);
  follow(pilot, sun, weight, 0, trials, workers, progress);
  std::vector<Square> squares = squares_of(trials);
  for (int round = 1; round <= kRounds && !squares.empty(); ++round) {
    const trace::SunMap map = map_of(squares);
    if (map.flaw()) return nullptr;
    const size_t before = trials.size();
    for (uint32_t i = 0; i < kAgain; ++i) {
      const auto r = sobol::sample(i, kSeed + uint64_t(round));
      const trace::SunMap::Start start = map.start(r[0], r[1]);
      trials.push_back({start.u, start.v, 0});
    }
    follow(pilot, sun, weight, before, trials, workers, progress);
    squares = squares_of(trials);
  }
  if (squares.empty()) return nullptr;
  add_surroundings(trials);
  squares = squares_of(trials);
  double even = 0, guided = 0;
  for (const Square& s : squares)
    even += area(s) * s.square, guided += area(s) * std::sqrt(s.square);
  if (!(even > kWorth * guided * guided)) return nullptr;
  auto map = std::make_shared<trace::SunMap>(map_of(squares));
  return map->flaw() ? nullptr : map;
}

}  // namespace deltalux::plan
