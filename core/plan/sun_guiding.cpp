// SPDX-License-Identifier: Apache-2.0
// Traces pilot paths from uniform starts and from starts towards what the sun sees, and builds a
// quadtree over them.
#include "plan/sun_guiding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/hemisphere.h"
#include "base/random.h"
#include "plan/pilot_points.h"
#include "plan/sun_openings.h"

namespace deltalux::plan {
namespace {

constexpr uint64_t kSeed = 20261124;
constexpr uint64_t kFirstPath = uint64_t(1) << 24;  // different from those of LightPilot::given()
constexpr uint32_t kEven = 16384;                   // uniform starts
constexpr uint32_t kPoints = 8192;                  // points of surfaces that may see the sun
constexpr uint32_t kCorners = 8192;                 // starts beside corners of triangles
constexpr uint32_t kTries = 16;                     // paths of a start that such a walk finds
constexpr float kNearest = 0.005f, kRange = 400;    // of a start beside a corner, in radii; factor
constexpr size_t kSplit = 16;                       // squares with this many starts are divided
constexpr int kDeepest = 18;  // levels: ten kilometres become four centimetres
// Weight of what is known of the square around, in useful paths, and the most in paths: land far
// away from all windows takes nothing over from their squares.
constexpr double kPrior = 2, kMostPrior = 64;
// Share of useful paths. Where fewer are, the square of what they bring would draw most paths to
// land that is far away, and brings hardly any light.
constexpr double kRare = 1.0 / 64;
constexpr double kBeside = 0.2;    // relative to a trial's value: what the squares around it get
constexpr int kRounds = 3;         // of further starts, drawn by what earlier ones have found
constexpr uint32_t kAgain = 8192;  // starts per round
constexpr size_t kBeams = 24;      // tried for openings around them
constexpr uint32_t kReflectors = 1024;  // of an opening
constexpr double kReflected = 0.5;  // share of the paths that land there, if all openings are small
constexpr double kWorth = 1.5;      // smallest reduction of variance for which a map is used

/// Pilot paths of a sun from one start.
struct Trial {
  float u, v;
  double square = 0;    ///< sum of the squares of what they contribute
  uint32_t useful = 0;  ///< those that contribute
  uint32_t paths = 1;
  /// Instead of paths: in proportion to the mean square of what comes from there into an opening,
  /// per `spread`, the area that it stands for.
  double reflected = 0, spread = 0;
  float size = 1;   ///< of the square that contains it
  float needs = 1;  ///< largest square that may contain it
};

/// Finds the starts of the paths that lead to points which the sun sees.
class Starts {
 public:
  using Start = std::array<float, 2>;
  Starts(const LightPilot& pilot, const lights::Punctual& sun)
      : pilot_(pilot),
        sun_(sun),
        size_u_(dot(sun.frame_u, sun.frame_u)),
        size_v_(dot(sun.frame_v, sun.frame_v)) {}

  /// Appends the start for a point just above a surface, if the sun sees it.
  void add(Vec3f p, std::vector<Start>& out) const {
    if (pilot_.caster().occluded_static(p, -sun_.direction, std::numeric_limits<float>::max()))
      return;
    add_towards(p, out);
  }
  /// Appends a start of paths that pass beside a corner of a triangle: there openings end that are
  /// too small to be found by chance.
  void add_beside(size_t i, std::vector<Start>& out) const {
    const scene::Scene& scene = pilot_.scene();
    const size_t triangle = i * scene.static_primitives() / kCorners;
    const auto r = sobol::sample(uint32_t(i), kSeed);
    const scene::Face face = scene.face(scene::kNone, uint32_t(triangle));
    const float away = pilot_.places().radius.front() * kNearest * std::pow(kRange, r[0]);
    const Vec3f u = normalize(sun_.frame_u), v = normalize(sun_.frame_v);
    add_towards(face.corner[i % 3] + on_circle(u, v, r[1]) * away, out);
  }
  /// The same for all vertices of a few light paths that are followed backwards from a place of the
  /// pilot: light there comes from where these go.
  void add_around(size_t place, std::vector<Start>& out) const {
    if (dot(pilot_.places().normal[place], sun_.direction) < 0) add(pilot_.above(place), out);
    pilot_.follow_back(place, kSeed, [&](Vec3f at, Vec3f normal, auto&&...) {
      if (dot(normal, sun_.direction) < 0) add(at, out);
    });
  }

 private:
  void add_towards(Vec3f p, std::vector<Start>& out) const {
    const Vec3f d = p - sun_.corner;
    const Start start{dot(d, sun_.frame_u) / size_u_, dot(d, sun_.frame_v) / size_v_};
    if (start[0] >= 0 && start[0] < 1 && start[1] >= 0 && start[1] < 1) out.push_back(start);
  }

  const LightPilot& pilot_;
  const lights::Punctual& sun_;
  float size_u_, size_v_;
};

/// Appends the starts that add(point, starts) finds for `count` points.
template <class Add>
void append(size_t count, const Add& add, const Workers& workers, const Progress& progress,
            std::vector<Trial>& trials) {
  std::vector<std::vector<Starts::Start>> seen(count);
  workers.for_blocks(count, 256, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i) add(i, seen[i]);
  });
  for (const auto& of_point : seen)
    for (const auto& [u, v] : of_point) trials.push_back({u, v});
}

/// Uniform starts, starts of paths that end on surfaces anywhere that the sun sees, and of paths
/// that pass beside corners.
std::vector<Trial> first_starts(const LightPilot& pilot, const Starts& starts, Vec3f direction,
                                const Workers& workers, const Progress& progress) {
  std::vector<Trial> trials;
  for (uint32_t i = 0; i < kEven; ++i) {
    const auto r = sobol::sample(i, kSeed);
    trials.push_back({r[0], r[1]});
  }
  const samples::SampleSet anywhere =
      surface_points(pilot.scene(), pilot.places().radius.front(), kPoints);
  const auto add = [&](size_t i, std::vector<Starts::Start>& out) {
    const Vec3f n = anywhere.normal[i] * (dot(anywhere.normal[i], direction) < 0 ? 1 : -1);
    starts.add(anywhere.point[i] + n * (anywhere.radius[i] * 0.01f), out);
  };
  append(anywhere.size(), add, workers, progress, trials);
  if (pilot.scene().static_primitives())
    append(
        kCorners, [&](size_t i, std::vector<Starts::Start>& out) { starts.add_beside(i, out); },
        workers, progress, trials);
  return trials;
}

/// Traces `tries` paths of each of the trials from index `from` on.
void follow(const LightPilot& pilot, const trace::Light& sun, std::span<const double> weight,
            size_t from, uint32_t tries, std::vector<Trial>& trials, const Workers& workers,
            Progress& progress) {
  static_assert(LightPilot::kChunk % kTries == 0);
  const size_t together = LightPilot::kChunk / tries;
  workers.for_blocks(trials.size() - from, together, [&](size_t begin, size_t end) {
    progress.check();
    std::vector<trace::Emission> starts;
    for (size_t i = from + begin; i < from + end; ++i)
      starts.insert(starts.end(), tries,
                    trace::emit_from(sun.punctual, {trials[i].u, trials[i].v, 0, 0}));
    double brought[LightPilot::kChunk];
    pilot.brought(sun, starts, kFirstPath + kTries * (from + begin), weight, brought);
    for (size_t k = 0; k < starts.size(); ++k) {
      Trial& own = trials[from + begin + k / tries];
      own.paths = tries;
      own.square += brought[k] * brought[k];
      own.useful += brought[k] > 0;
    }
  });
  progress.advance(1);
}

struct Square {
  float u, v, size;
  double square;     ///< mean of what starts in it contribute, squared
  double reflected;  ///< see Trial: per area
};

/// A quadtree over the rectangle, whose leaves hold few trials.
class Quadtree {
 public:
  Quadtree(std::vector<Trial>& trials, size_t split) : split_(split) {
    nodes_.push_back({0, 0, 1});
    fill(trials, 0, trials.size(), 0, 0);
  }
  /// The leaves. What is found in a square adds to what is known of the square around it. That a
  /// few paths are useless says nothing where few are useful: of those that land before a window,
  /// one in a hundred enters it.
  std::vector<Square> leaves() const {
    std::vector<Square> out;
    collect(0, nodes_.front().mean, out);
    return out;
  }

 private:
  /// Of a path. Means are over the area, not over paths, most of which start where it is bright.
  struct Yield {
    double square = 0;
    double useful = 0;  ///< share of the paths
  };
  struct Node {
    float u, v, size;
    uint32_t child = 0;  ///< first of four; 0: a leaf
    double paths = 0;
    Yield mean{};
    double reflected = 0;  ///< of a leaf
  };

  /// Divides the node's square recursively; [begin, end) are the trials in it.
  void fill(std::vector<Trial>& trials, size_t begin, size_t end, uint32_t index, int depth) {
    Node own = nodes_[index];
    float finest = 1;
    double spread = 0;
    for (size_t i = begin; i < end; ++i) {
      own.paths += trials[i].paths;
      own.mean.square += trials[i].square, own.mean.useful += trials[i].useful;
      own.reflected += trials[i].reflected, spread += trials[i].spread;
      finest = std::min(finest, trials[i].needs);
    }
    if ((end - begin < split_ && own.size <= finest) || depth == kDeepest) {
      for (size_t i = begin; i < end; ++i) trials[i].size = own.size;
      own.mean.square /= std::max(1.0, own.paths), own.mean.useful /= std::max(1.0, own.paths);
      if (spread > 0) own.reflected /= spread;
      nodes_[index] = own;
      return;
    }
    own.mean = {};
    const float half = 0.5f * own.size;
    const auto first = trials.begin();
    const auto part = [&](size_t from, size_t to, auto axis, float at) {
      return size_t(std::partition(first + long(from), first + long(to),
                                   [&](const Trial& trial) { return trial.*axis < at; }) -
                    first);
    };
    const size_t middle = part(begin, end, &Trial::v, own.v + half);
    const size_t cut[5] = {begin, part(begin, middle, &Trial::u, own.u + half), middle,
                           part(middle, end, &Trial::u, own.u + half), end};
    own.child = uint32_t(nodes_.size());
    for (int k = 0; k < 4; ++k)
      nodes_.push_back({own.u + (k & 1 ? half : 0), own.v + (k & 2 ? half : 0), half});
    for (uint32_t k = 0; k < 4; ++k) {
      fill(trials, cut[k], cut[k + 1], own.child + k, depth + 1);
      const Yield& part = nodes_[own.child + k].mean;
      own.mean.square += 0.25 * part.square, own.mean.useful += 0.25 * part.useful;
    }
    nodes_[index] = own;
  }
  void collect(uint32_t index, const Yield& around, std::vector<Square>& out) const {
    const Node& own = nodes_[index];
    // As many paths around as have kPrior useful ones among them.
    const double others = around.useful > 0 ? std::min(kMostPrior, kPrior / around.useful) : 0;
    const auto both = [&](double of_others, double mean) {
      const double all = others + own.paths;
      return all > 0 ? (others * of_others + own.paths * mean) / all : 0;
    };
    const Yield known{both(around.square, own.mean.square), both(around.useful, own.mean.useful)};
    const double often = std::min(1.0, known.useful / kRare);
    if (!own.child)
      return out.push_back({own.u, own.v, own.size, known.square * often, own.reflected});
    for (uint32_t k = 0; k < 4; ++k) collect(own.child + k, known, out);
  }

  size_t split_;
  std::vector<Node> nodes_;
};

double area(const Square& s) { return double(s.size) * double(s.size); }

double mean_square(const std::vector<Trial>& trials) {
  double sum = 0, paths = 0;
  for (const Trial& trial : trials) sum += trial.square, paths += trial.paths;
  return sum / paths;
}

/// Adds trials around bright ones. Parts of a window may extend into squares where no trial hit it;
/// a path that starts there would have hundreds of times the weight of its neighbours.
void add_surroundings(std::vector<Trial>& trials) {
  const double mean = mean_square(trials);
  const size_t count = trials.size();
  for (size_t i = 0; i < count; ++i) {
    const Trial own = trials[i];
    if (own.paths == 0) continue;
    const double square = own.square / own.paths;
    if (!(square > mean)) continue;
    for (int dv = -1; dv <= 1; ++dv)
      for (int du = -1; du <= 1; ++du) {
        const float u = own.u + float(du) * own.size, v = own.v + float(dv) * own.size;
        if ((du || dv) && u >= 0 && u < 1 && v >= 0 && v < 1)
          trials.push_back({u, v, kBeside * square, 1, 1, 0, 0, 1, own.size});
      }
  }
}

/// The opening that lets in the beam of a path; nullopt if there is none.
std::optional<Opening> opening_of(const LightPilot& pilot, const lights::Punctual& sun,
                                  const Trial& beam) {
  const trace::Emission start = trace::emit_from(sun, {beam.u, beam.v, 0, 0});
  const trace::Hit hit = pilot.caster().closest_static(start.origin, start.direction);
  if (!hit.valid()) return std::nullopt;
  const Vec3f n = trace::facing_normal(hit, start.direction);
  const Vec3f at = trace::leave_surface(start.origin, start.direction, hit, n,
                                        pilot.scene().slack_of(hit.primitive));
  return find_opening(pilot.caster(), at, -start.direction);
}

/// Adds places from which light is reflected into small openings that let in the sun. Returns the
/// share of these among the openings that beams pass.
double add_reflectors(const LightPilot& pilot, const lights::Punctual& sun, const Starts& starts,
                      std::vector<Trial>& trials) {
  std::vector<size_t> beams;
  for (size_t i = 0; i < trials.size(); ++i)
    if (trials[i].useful && 2 * trials[i].useful >= trials[i].paths) beams.push_back(i);
  const size_t count = std::min(kBeams, beams.size());
  double all = 0, small = 0;
  std::vector<Starts::Start> at;
  for (size_t k = 0; k < count; ++k) {
    const auto opening = opening_of(pilot, sun, trials[beams[k * beams.size() / count]]);
    if (!opening) continue;
    ++all;
    if (opening->radius > pilot.places().radius.front()) continue;  // paths find it
    ++small;
    for (const Reflector& r :
         reflectors_of(pilot.scene(), pilot.caster(), *opening, kReflectors, kSeed + k)) {
      if (!(r.chance > 0) || dot(r.normal, sun.direction) >= 0) continue;
      at.clear();
      starts.add(r.at, at);
      const double share = photopic(Vec3d(pilot.scene().material_of(r.primitive).reflectance));
      // Squared again: light from far away is little, but would draw as many paths as what is near.
      const double reflected = share * share * r.chance;
      for (const auto& [u, v] : at) trials.push_back({u, v, 0, 0, 0, reflected, 1 / r.chance});
    }
  }
  return all > 0 ? small / all : 0;
}

std::vector<Square> squares_of(std::vector<Trial>& trials) {
  if (!(mean_square(trials) > 0)) return {};
  std::vector<Square> squares;
  for (size_t split = kSplit; squares.empty() || squares.size() > trace::SunMap::kMaxLeaves;
       split *= 2)
    squares = Quadtree(trials, split).leaves();
  return squares;
}

/// The chances of the squares in steps of what path starts resolve; each has at least one step, so
/// that the weight of a start is exactly what its chance demands.
std::vector<uint32_t> chances_of(const std::vector<Square>& squares) {
  constexpr double kMinDensity = double(trace::SunMap::kMinDensity);
  double all = 0;
  for (const Square& s : squares) all += area(s) * std::sqrt(s.square);
  std::vector<uint32_t> steps;
  int64_t left = trace::SunMap::kSteps;
  for (const Square& s : squares) {
    const double chance = area(s) * (kMinDensity + (1 - kMinDensity) * std::sqrt(s.square) / all);
    steps.push_back(std::max(1u, uint32_t(std::ceil(chance * double(trace::SunMap::kSteps)))));
    left -= steps.back();
  }
  // What rounding takes too much comes from the largest ones, where it shows least.
  std::vector<uint32_t> order(squares.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return steps[a] > steps[b]; });
  for (size_t k = 0; left < 0 && k < order.size(); ++k) {
    uint32_t& own = steps[order[k]];
    const int64_t taken = std::min<int64_t>(-left, own / 8);
    own -= uint32_t(taken), left += taken;
  }
  steps[order.front()] += uint32_t(std::max<int64_t>(0, left));
  return steps;
}

/// Gives a share of the paths to what is reflected into small openings. Hardly any of them comes
/// in, so that pilot paths do not tell; but together they may bring as much as the beam, and each
/// would outshine it if few started there.
void share_with_reflectors(std::vector<Square>& squares, double share) {
  double others = 0, reflected = 0;
  for (const Square& s : squares)
    others += area(s) * std::sqrt(s.square), reflected += area(s) * std::sqrt(s.reflected);
  if (!(reflected > 0)) return;
  const double factor = share / (1 - share) * others / reflected;
  for (Square& s : squares) {
    const double both = std::sqrt(s.square) + factor * std::sqrt(s.reflected);
    s.square = both * both;
  }
}

trace::SunMap map_of(const std::vector<Square>& squares) {
  const std::vector<uint32_t> steps = chances_of(squares);
  trace::SunMap map;
  uint32_t below = 0;
  for (size_t i = 0; i < squares.size(); ++i) {
    map.leaves.push_back(
        {squares[i].u, squares[i].v, squares[i].size, float(below) / float(trace::SunMap::kSteps)});
    below += steps[i];
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
  progress.begin("find windows", 2 + kRounds);
  const Starts starts(pilot, sun.punctual);
  std::vector<Trial> trials =
      first_starts(pilot, starts, sun.punctual.direction, workers, progress);
  follow(pilot, sun, weight, 0, 1, trials, workers, progress);
  // Where light for the pilot's places comes from. Few of the paths that land before a window enter
  // it, but these bring much.
  const size_t found = trials.size();
  append(
      pilot.points(), [&](size_t i, std::vector<Starts::Start>& out) { starts.add_around(i, out); },
      workers, progress, trials);
  follow(pilot, sun, weight, found, kTries, trials, workers, progress);
  std::vector<Square> squares = squares_of(trials);
  for (int round = 1; round <= kRounds && !squares.empty(); ++round) {
    const trace::SunMap map = map_of(squares);
    if (map.flaw()) return nullptr;
    const size_t before = trials.size();
    for (uint32_t i = 0; i < kAgain; ++i) {
      const auto r = sobol::sample(i, kSeed + uint64_t(round));
      const trace::SunMap::Start start = map.start(r[0], r[1]);
      trials.push_back({start.u, start.v});
    }
    follow(pilot, sun, weight, before, 1, trials, workers, progress);
    squares = squares_of(trials);
  }
  if (squares.empty()) return nullptr;
  const double small = add_reflectors(pilot, sun.punctual, starts, trials);
  add_surroundings(trials);
  squares = squares_of(trials);
  share_with_reflectors(squares, kReflected * small);
  double even = 0, guided = 0;
  for (const Square& s : squares)
    even += area(s) * s.square, guided += area(s) * std::sqrt(s.square);
  if (!(even > kWorth * guided * guided)) return nullptr;
  auto map = std::make_shared<trace::SunMap>(map_of(squares));
  return map->flaw() ? nullptr : map;
}

}  // namespace deltalux::plan
