// SPDX-License-Identifier: Apache-2.0
// Casts rays from samples, and looks for the narrowest place that bright ones pass.
#include "gather/choose/find_portals.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/hemisphere.h"
#include "gather/choose/brightness_survey.h"
#include "gather/choose/find_gaps.h"
#include "gather/choose/sight_lines.h"

namespace deltalux::gather {
namespace {

constexpr size_t kPlaces = 1024;       // samples that are asked
constexpr size_t kRaysInAll = 262144;  // of all of them together
constexpr uint32_t kLeastRays = 256, kMostRays = 4096;
constexpr uint32_t kPastCorners = 4;  // one of so many rays passes a corner
constexpr size_t kMostLines = 512, kMostPairs = 128;
constexpr size_t kLeastLines = 4;
constexpr double kMinShare = 0.01;  // of all places' variance, for an opening to be worth a guide
constexpr float kNarrow = 0.15f;    // largest radius of an opening, in distances of those who look
constexpr float kApart = 8;         // radii: lines of an opening start farther apart
constexpr double kFramed = 0.5, kFlat = 0.5;  // share of looks beside it that a wall stops nearby
constexpr float kOblique = 4;  // largest radius in the plane of the wall, in radii of the waist
constexpr size_t kMostPortals = 16, kMostGaps = 12;
constexpr uint32_t kLooks = 3;  // of a texel
constexpr int kTries = 32;
constexpr float kSpare = 1.2f;  // times the radius within which the lines pass: the guide's half

/// The midpoint of the shortest connection of two lines; none if they are parallel.
std::optional<Vec3f> crossing(const SightLine& a, const SightLine& b) {
  const float cosine = dot(a.w, b.w), sine_squared = 1 - cosine * cosine;
  if (!(sine_squared > 1e-6f)) return std::nullopt;
  const Vec3f d = b.from - a.from;
  const float t = (dot(d, a.w) - cosine * dot(d, b.w)) / sine_squared;
  const float s = (cosine * dot(d, a.w) - dot(d, b.w)) / sine_squared;
  if (!(t > SightLine::kEnds * a.length && t <= a.length && s > SightLine::kEnds * b.length &&
        s <= b.length))
    return std::nullopt;
  return (a.at(t) + b.at(s)) * 0.5f;
}

/// A place that many lines pass.
struct Waist {
  Vec3f centre;
  float radius = 0;
  double score = 0;
  std::vector<uint32_t> lines;  ///< those that pass
};

/// The lines that pass closest by, as many as make the best of this centre.
Waist waist_at(std::span<const SightLine> lines, Vec3f centre) {
  std::vector<std::pair<float, uint32_t>> by_distance;
  for (uint32_t i = 0; i < lines.size(); ++i)
    by_distance.emplace_back(lines[i].distance(centre), i);
  std::sort(by_distance.begin(), by_distance.end());
  const float away = length(lines.front().from - centre);
  Waist out;
  out.centre = centre;
  size_t best = 0;
  double weight = 0;
  for (size_t k = 0; k < by_distance.size(); ++k) {
    const auto [distance, line] = by_distance[k];
    if (distance > kNarrow * away) break;
    weight += lines[line].weight;
    if (k + 1 < kLeastLines) continue;
    // Within an opening, the number of lines grows with the square of the distance.
    const double score = weight / double(distance + 2e-3f * away);
    if (score > out.score) out.score = score, out.radius = distance, best = k + 1;
  }
  for (size_t k = 0; k < best; ++k) out.lines.push_back(by_distance[k].second);
  return out;
}

/// The narrowest place that the first line passes together with others.
Waist narrowest(std::span<const SightLine> lines) {
  Waist best;
  for (size_t j = 1; j < std::min(lines.size(), kMostPairs); ++j)
    if (const auto centre = crossing(lines[0], lines[j])) {
      Waist own = waist_at(lines, *centre);
      if (own.score > best.score) best = std::move(own);
    }
  return best;
}

/// Places the guide's square into the plane of what surrounds the opening. Returns false if the
/// waist is none: its lines start in one place, or nothing beside it stops those who look there.
bool place(const Context& context, std::span<const SightLine> lines, const Waist& waist,
           Guide& guide) {
  constexpr int kAround = 8;
  constexpr float kAlike = 0.98f;
  struct Side {
    Vec3f normal, at;
  };
  std::vector<Side> sides;
  Box starts;
  for (const uint32_t i : waist.lines) {
    const SightLine& line = lines[i];
    starts.grow(line.from);
    Vec3f u, v;
    tangent_frame(line.w, u, v);
    for (int k = 0; k < kAround; ++k) {
      const Vec3f q = waist.centre + on_circle(u, v, float(k) / kAround) *
                                         (2 * waist.radius + 1e-3f * line.length);
      const Vec3f d = q - line.from, w = normalize(d);
      const trace::Hit hit = context.caster.closest(line.from, w);
      if (!hit.valid()) continue;
      const Vec3f at = line.from + w * hit.t;
      if (length(at - waist.centre) < 8 * waist.radius + 4e-3f * line.length)
        sides.push_back({trace::facing_normal(hit, w), at});
    }
  }
  if (!(starts.diagonal() > kApart * waist.radius)) return false;
  if (sides.size() < kFramed * kAround * waist.lines.size()) return false;
  size_t most = 0;
  for (const Side& side : sides) {
    const auto alike = [&](const Side& other) { return dot(side.normal, other.normal) > kAlike; };
    const auto count = size_t(std::count_if(sides.begin(), sides.end(), alike));
    if (count <= most || !is_unit(side.normal)) continue;
    most = count;
    std::vector<float> heights;
    for (const Side& other : sides)
      if (alike(other)) heights.push_back(dot(other.at - waist.centre, side.normal));
    guide.normal = side.normal;
    std::nth_element(heights.begin(), heights.begin() + long(heights.size() / 2), heights.end());
    guide.centre = waist.centre + side.normal * heights[heights.size() / 2];
  }
  if (most < kFlat * sides.size()) return false;
  Box box;
  std::vector<Vec3f> through;
  for (const uint32_t i : waist.lines) {
    const float along = dot(lines[i].w, guide.normal);
    const float t = dot(guide.centre - lines[i].from, guide.normal) / along;
    if (!(std::fabs(along) > 0.05f) || !(t > 0)) continue;
    through.push_back(lines[i].at(t)), box.grow(through.back());
  }
  if (through.size() < kLeastLines) return false;
  guide.centre = box.centre();
  float radius = waist.radius;
  for (const Vec3f& p : through) radius = std::max(radius, length(p - guide.centre));
  guide.half = kSpare * radius;
  return radius <= kOblique * waist.radius;
}

/// Some of the receivers, at random by a hash.
std::vector<const direct::Receiver*> chosen_of(std::span<const direct::Receiver> receivers) {
  std::vector<uint32_t> asked;
  for (uint32_t i = 0; i < receivers.size(); ++i)
    if (!(receivers[i].normal == Vec3f{})) asked.push_back(i);
  std::sort(asked.begin(), asked.end(), [&](uint32_t a, uint32_t b) {
    const uint64_t p = receivers[a].key, q = receivers[b].key;
    return p != q ? p < q : a < b;
  });
  if (asked.size() > kPlaces) asked.resize(kPlaces);
  std::vector<const direct::Receiver*> chosen;
  for (const uint32_t i : asked) chosen.push_back(&receivers[i]);
  return chosen;
}

}  // namespace

std::vector<Guide> find_portals(const Context& context, const Evaluation& evaluation,
                                std::span<const Guide> known, uint64_t seed, const Workers& workers,
                                Progress& progress) {
  const std::vector<const direct::Receiver*> asked = chosen_of(context.receivers);
  if (asked.empty()) return {};
  const auto rays = uint32_t(
      std::clamp<size_t>(kRaysInAll / asked.size(), size_t(kLeastRays), size_t(kMostRays)));
  const uint32_t past_corners = rays / kPastCorners;
  const Directions directions(rays, seed ^ 0x706f7274616c2121ull);
  const CellFinder finder(context.scene, context.cells);
  const Eyes eyes{context,    evaluation,          finder,       known,
                  directions, rays - past_corners, past_corners, seed};
  std::vector<Look> found(asked.size());
  progress.begin("find openings", found.size());
  workers.for_blocks(found.size(), 16, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i) found[i] = eyes.look(*asked[i]);
    progress.advance(end - begin);
  });
  std::vector<Guide> portals = find_gaps(eyes, asked, found, kMostGaps, progress);
  double variance = 0;
  std::vector<SightLine> lines;
  for (const Look& own : found) {
    variance += own.variance;
    for (const SightLine& line : own.bright)
      if (!passes(portals, line.from, line.w)) lines.push_back(line);
  }
  std::stable_sort(lines.begin(), lines.end(),
                   [](const SightLine& a, const SightLine& b) { return a.weight > b.weight; });
  if (lines.size() > kMostLines) lines.resize(kMostLines);

  for (int t = 0; t < kTries && portals.size() < kMostPortals; ++t) {
    if (lines.size() < kLeastLines) break;
    progress.check();
    const Waist waist = narrowest(lines);
    double weight = 0;
    std::vector<float> around;
    for (const uint32_t i : waist.lines)
      weight += lines[i].weight, around.push_back(lines[i].around);
    if (weight < kMinShare * variance) {
      lines.erase(lines.begin());
      continue;
    }
    Guide guide{};
    guide.around = quantile(around, 0.5);
    if (place(context, lines, waist, guide)) {
      guide.rise = 0.1f * guide.half;
      std::vector<Vec3f> from;
      for (const uint32_t i : waist.lines) from.push_back(lines[i].from);
      paint(eyes, from, kLooks, guide);
      if (!guide.flaw()) portals.push_back(guide);
    }
    std::vector<SightLine> left;
    for (const SightLine& line : lines)
      if (line.distance(waist.centre) > 2 * waist.radius) left.push_back(line);
    lines.swap(left);
  }
  return portals;
}

}  // namespace deltalux::gather
