// SPDX-License-Identifier: Apache-2.0
// Finds bright places by what rays hit; hits close together form one guide.
#include "gather/choose/find_guides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/random.h"
#include "gather/choose/radiosity.h"

namespace deltalux::gather {
namespace {

// scene metres: farther from the brightest hit, another place begins
constexpr float kReach = 1.5f;
constexpr double kTaken = 0.9;   // share of the bright hits in reach that a guide must contain
constexpr float kBeyond = 1.3f;  // times the radius of those: the guide's radius
constexpr float kAlike = 0.9f;   // cosine: normals of one place differ by less
// in units of half a cell's edge: how far a place may deviate from a plane
constexpr float kFlat = 0.3f;
constexpr float kFalloff = 0.3f;  // radiosities within this factor of each other count as equal
constexpr int kMaxTried = 1024;   // places
constexpr int kMaxLayers = 4;     // surfaces, one behind the other
constexpr float kLittle = 0.25f;  // share of a guide
constexpr uint32_t kPoints = 16;  // of a texel then
constexpr uint32_t kBeside = Beam::kPoints / 10;  // points of a beam: from here on, it is its pool

/// The distance from the first hit within which most bright hits beside it lie, plus a margin.
template <class Beside>
float extent(const std::vector<BrightHit>& hits, const Beside& beside, float margin) {
  std::vector<std::pair<float, double>> found;
  double all = 0;
  for (const BrightHit& hit : hits)
    if (hit.bright() && beside(hit)) {
      found.emplace_back(length(hit.at - hits.front().at), hit.weight);
      all += hit.weight;
    }
  std::sort(found.begin(), found.end());
  double sum = 0;
  for (const auto& [distance, weight] : found)
    if ((sum += weight) >= kTaken * all) return kBeyond * distance + margin;
  return margin;
}

/// Removes the first hit and those around it from the list. Returns a guide if most places that
/// see these hits see them as bright. A wall is bright only to those who see it through a gap.
std::optional<Guide> take_place(std::vector<BrightHit>& hits, float reach, float margin) {
  const BrightHit first = hits.front();
  const auto beside = [&](const BrightHit& other) {
    const Vec3f d = other.at - first.at;
    return dot(d, d) < reach * reach && std::fabs(dot(d, first.normal)) < kFlat * margin &&
           dot(other.normal, first.normal) > kAlike;
  };
  reach = std::min(reach, extent(hits, beside, margin));
  const auto alike = [&](const BrightHit& other) {
    return other.radiosity > kFalloff * first.radiosity &&
           kFalloff * other.radiosity < first.radiosity && beside(other);
  };
  size_t bright = 0, as_bright = 0;
  double weight = 0, variance = 0;  // of the place; of all hits left
  Box box;
  Vec3d normal{};
  std::vector<float> around;
  for (const BrightHit& hit : hits) {
    variance += hit.weight;
    if (!beside(hit)) continue;
    // Use the median over all that look there: those that happened to hit the brightest point
    // overestimate their surroundings.
    around.push_back(hit.around);
    if (alike(hit)) ++as_bright, bright += hit.bright();
    if (!hit.bright()) continue;
    box.grow(hit.at);
    normal = normal + Vec3d(hit.normal) * hit.weight;
    weight += hit.weight;
  }
  if (!BrightnessSurvey::suffice(bright, as_bright, weight, variance)) {
    std::erase_if(hits, alike);
    return std::nullopt;
  }
  Guide guide{};
  guide.centre = box.centre(), guide.normal = normalize(Vec3f(normal));
  guide.around = quantile(around, 0.5), guide.rise = margin;
  for (const BrightHit& hit : hits)
    if (hit.bright() && beside(hit))
      guide.half = std::max(guide.half, length(hit.at - guide.centre) + margin);
  std::erase_if(hits, beside);
  return guide;
}

/// The brightest of the surfaces near a point of the guide, seen along the guide's normal, each by
/// itself: a bulb is close in front of its socket.
float brightest_layer(const Guide& guide, Vec3f at, const Context& context,
                      const Evaluation& evaluation, const CellFinder& finder) {
  // Start close by: a lamp shade may stand in front.
  const Vec3f above = at + guide.normal * guide.rise;
  float from = 0, brightest = 0;
  for (int layer = 0; layer < kMaxLayers; ++layer) {
    const trace::Hit hit = context.caster.closest(above, -guide.normal, from, 2 * guide.rise);
    if (!hit.valid()) break;
    const uint32_t cell = finder.find(hit.primitive, above, -guide.normal, hit.t);
    if (cell != kNoCell)
      brightest =
          std::max(brightest, radiosity_at(context, evaluation, above, -guide.normal, hit, cell));
    from = hit.t + position_slack(above) + context.scene.slack_of(hit.primitive);
  }
  return brightest;
}

/// Sets the probabilities of the guide's texels by the mean light of what is at these points of a
/// texel.
void paint(Guide& guide, const Context& context, const Evaluation& evaluation,
           const CellFinder& finder, std::span<const std::array<float, 4>> points) {
  constexpr size_t kSide = Guide::kSide;
  Guide::Texels texel{};
  for (size_t k = 0; k < kSide; ++k)
    for (size_t i = 0; i < kSide; ++i) {
      for (const auto& r : points) {
        const Vec3f at = guide.point((float(i) + r[0]) / kSide, (float(k) + r[1]) / kSide);
        texel[k][i] += brightest_layer(guide, at, context, evaluation, finder);
      }
      texel[k][i] /= float(points.size());
    }
  guide.set_texels(texel, points.size() > 1);
}

/// The same from the middle of the texels; where a sun shines on little of the guide, from more
/// points: a strip of it may pass between those.
void paint(Guide& guide, const Context& context, const Evaluation& evaluation,
           const CellFinder& finder) {
  const std::array<float, 4> middle{0.5f, 0.5f, 0, 0};
  paint(guide, context, evaluation, finder, std::span(&middle, 1));
  const float even = guide.radiosity / guide.brightest;
  if (context.suns.lights().empty() || even * even >= kLittle) return;
  std::array<std::array<float, 4>, kPoints> points;
  for (uint32_t i = 0; i < kPoints; ++i) points[i] = sobol::sample(i, kPoints);
  paint(guide, context, evaluation, finder, points);
}

/// The largest number of points that one of the beams has on the guide.
uint32_t points_on(const Guide& guide, const Beams& beams) {
  uint32_t most = 0;
  for (size_t b = 0; b < beams.size(); ++b) {
    uint32_t own = 0;
    for (uint32_t k = 0; k < Beam::kPoints; ++k) {
      const Beam::Point& point = beams[b].point(k);
      own += point.valid() && dot(point.normal, guide.normal) > kAlike && guide.holds(point.at);
    }
    most = std::max(most, own);
  }
  return most;
}

}  // namespace

std::vector<Guide> find_guides(const Context& context, const Evaluation& evaluation,
                               const BrightnessSurvey& survey, Progress& progress) {
  const CellFinder finder(context.scene, context.cells);
  std::vector<BrightHit> left = survey.all;
  std::vector<Guide> guides;
  const float margin = 0.5f * context.cells.edge();
  for (int tried = 0; tried < kMaxTried && guides.size() < kMaxGuides; ++tried) {
    if (left.empty() || !left.front().bright()) break;
    std::optional<Guide> guide = take_place(left, kReach * context.cells.metre(), margin);
    progress.check();
    if (!guide) continue;
    paint(*guide, context, evaluation, finder);
    if (!guide->flaw()) guides.push_back(*guide);
  }
  return guides;
}

std::vector<Guide> find_beside_pools(std::span<const Guide> all, const Beams& beams,
                                     std::span<const Guide> known) {
  std::vector<Guide> out;
  for (const Guide& guide : all) {
    const uint32_t points = points_on(guide, beams);
    if (points > 0 && points < kBeside &&
        std::none_of(
            known.begin(), known.end(),
            [&](const Guide& other) {
              return dot(other.normal, guide.normal) > kAlike && other.holds(guide.centre);
            }))
      out.push_back(guide);
  }
  return out;
}

}  // namespace deltalux::gather
