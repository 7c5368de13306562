// SPDX-License-Identifier: Apache-2.0
// Finds bright places by votes; those close together form one guide.
#include "gather/find_guides.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace deltalux::gather {
namespace {

// scene metres: farther from the brightest vote, another place begins
constexpr float kReach = 1.5f;
constexpr double kTaken = 0.9;   // share of the bright votes in reach that a guide must contain
constexpr float kBeyond = 1.3f;  // times the radius of those: the guide's radius
constexpr float kAlike = 0.9f;   // cosine: normals of one place differ by less
// in units of half a cell's edge: how far a place may deviate from a plane
constexpr float kFlat = 0.3f;
constexpr float kFalloff = 0.3f;  // radiosities within this factor of each other count as equal
constexpr int kMaxTried = 1024;   // places
constexpr int kMaxLayers = 4;     // surfaces, one behind the other
// of a texel, relative to the mean: it may have light that its cell does not show
constexpr double kMinChance = 0.05;

/// The distance from the first vote within which most bright votes beside it lie, plus a margin.
template <class Beside>
float extent(const std::vector<Vote>& votes, const Beside& beside, float margin) {
  std::vector<std::pair<float, double>> found;
  double all = 0;
  for (const Vote& vote : votes)
    if (vote.bright() && beside(vote)) {
      found.emplace_back(length(vote.at - votes.front().at), vote.weight);
      all += vote.weight;
    }
  std::sort(found.begin(), found.end());
  double sum = 0;
  for (const auto& [distance, weight] : found)
    if ((sum += weight) >= kTaken * all) return kBeyond * distance + margin;
  return margin;
}

/// Removes the first vote and those around it from the list. Returns a guide if most places that
/// see these votes see them as bright. A wall is bright only to those who see it through a gap.
std::optional<Guide> take_place(std::vector<Vote>& votes, float reach, float margin) {
  const Vote first = votes.front();
  const auto beside = [&](const Vote& other) {
    const Vec3f d = other.at - first.at;
    return dot(d, d) < reach * reach && std::fabs(dot(d, first.normal)) < kFlat * margin &&
           dot(other.normal, first.normal) > kAlike;
  };
  reach = std::min(reach, extent(votes, beside, margin));
  const auto alike = [&](const Vote& other) {
    return other.radiosity > kFalloff * first.radiosity &&
           kFalloff * other.radiosity < first.radiosity && beside(other);
  };
  size_t bright = 0, as_bright = 0;
  double weight = 0, variance = 0;  // of the place; of all votes left
  Box box;
  Vec3d normal{};
  std::vector<float> around;
  for (const Vote& vote : votes) {
    variance += vote.weight;
    if (!beside(vote)) continue;
    // Use the median over all that look there: those that happened to hit the brightest point
    // overestimate their surroundings.
    around.push_back(vote.around);
    if (alike(vote)) ++as_bright, bright += vote.bright();
    if (!vote.bright()) continue;
    box.grow(vote.at);
    normal = normal + Vec3d(vote.normal) * vote.weight;
    weight += vote.weight;
  }
  if (!Votes::suffice(bright, as_bright, weight, variance)) {
    std::erase_if(votes, alike);
    return std::nullopt;
  }
  Guide guide{};
  guide.centre = box.centre(), guide.normal = normalize(Vec3f(normal));
  guide.around = quantile(around, 0.5), guide.rise = margin;
  for (const Vote& vote : votes)
    if (vote.bright() && beside(vote))
      guide.half = std::max(guide.half, length(vote.at - guide.centre) + margin);
  std::erase_if(votes, beside);
  return guide;
}

/// Radiosity at a ray's hit due to suns whose light no cell counts.
float sunlight(const Present& present, const Evaluation& evaluation, Vec3f origin, Vec3f w,
               const trace::Hit& hit) {
  const direct::Receiver at = present.landing(origin, w, hit);
  const Vec3f reflectance =
      present.scene.material_of(hit.primitive)
          .reflectance_at(present.scene.point_on(hit.primitive, hit.u, hit.v));
  float sum = 0;
  for (const uint32_t number : present.suns.lights()) {
    const lights::Punctual& sun = present.lights[number].punctual;
    const auto share = float(sun.kind->irradiance(sun, at.point, at.normal, at.slack()));
    const Vec3f from = at.point + at.normal * at.slack();
    const auto [direction, to] = sun.kind->shadow_ray(sun, from);
    if (share > 0 && !present.caster.occluded(from, direction, to))
      sum += evaluation.dim(number) * share * dot(sun.intensity, reflectance);
  }
  return sum;
}

/// The brightest of the surfaces near a point of the guide, seen along the guide's normal, each by
/// itself: a bulb is close in front of its socket.
float brightest_layer(const Guide& guide, Vec3f at, const Present& present,
                      const Evaluation& evaluation, const CellFinder& finder) {
  // Start close by: a lamp shade may stand in front.
  const Vec3f above = at + guide.normal * guide.rise;
  float from = 0, brightest = 0;
  for (int layer = 0; layer < kMaxLayers; ++layer) {
    const trace::Hit hit = present.caster.closest(above, -guide.normal, from, 2 * guide.rise);
    if (!hit.valid()) break;
    const uint32_t cell = finder.find(hit.primitive, above, -guide.normal, hit.t);
    if (cell != kNoCell)
      brightest = std::max(brightest, evaluation.brightness(cell) +
                                          sunlight(present, evaluation, above, -guide.normal, hit));
    from = hit.t + position_slack(above) + present.scene.slack_of(hit.primitive);
  }
  return brightest;
}

/// Sets the probabilities of the guide's texels by the light of what is there.
void paint(Guide& guide, const Present& present, const Evaluation& evaluation,
           const CellFinder& finder) {
  constexpr size_t kSide = Guide::kSide;
  std::array<std::array<float, kSide>, kSide> texel{};
  double sum = 0, squares = 0;
  for (size_t k = 0; k < kSide; ++k)
    for (size_t i = 0; i < kSide; ++i) {
      const Vec3f at = guide.point((float(i) + 0.5f) / kSide, (float(k) + 0.5f) / kSide);
      texel[k][i] = brightest_layer(guide, at, present, evaluation, finder);
      sum += double(texel[k][i]), squares += double(texel[k][i]) * double(texel[k][i]);
    }
  constexpr double kTexels = double(kSide * kSide);
  guide.radiosity = float(sum / kTexels), guide.brightest = float(std::sqrt(squares / kTexels));
  // Take the maximum over neighbours: a texel across the border of two cells may be as bright as
  // the brighter one.
  const auto brightest = [&](size_t k, size_t i) {
    float most = float(kMinChance * sum / kTexels);
    for (size_t y = k > 0 ? k - 1 : 0; y < std::min(k + 2, kSide); ++y)
      for (size_t x = i > 0 ? i - 1 : 0; x < std::min(i + 2, kSide); ++x)
        most = std::max(most, texel[y][x]);
    return most;
  };
  auto chance = texel;
  double all = 0;
  for (size_t k = 0; k < kSide; ++k)
    for (size_t i = 0; i < kSide; ++i) all += double(chance[k][i] = brightest(k, i));
  double rows = 0;
  for (size_t k = 0; k < kSide; ++k) {
    double line = 0, before = 0;
    for (float value : chance[k]) line += double(value);
    guide.row[k] = float(rows / all), rows += line;
    for (size_t i = 0; i < kSide; ++i)
      guide.column[k][i] = float(before / line), before += double(chance[k][i]);
    guide.column[k][kSide] = 1;
  }
  guide.row[kSide] = 1;
}

}  // namespace

std::vector<Guide> find_guides(const Present& present, const Evaluation& evaluation,
                               const Votes& votes, Progress& progress) {
  const CellFinder finder(present.scene, present.cells);
  std::vector<Vote> left = votes.all;
  std::vector<Guide> guides;
  const float margin = 0.5f * present.cells.edge();
  for (int tried = 0; tried < kMaxTried && guides.size() < kMaxGuides; ++tried) {
    if (left.empty() || !left.front().bright()) break;
    std::optional<Guide> guide = take_place(left, kReach * present.cells.metre(), margin);
    progress.check();
    if (!guide) continue;
    paint(*guide, present, evaluation, finder);
    if (!guide->flaw()) guides.push_back(*guide);
  }
  return guides;
}

}  // namespace deltalux::gather
