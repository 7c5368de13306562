// SPDX-License-Identifier: Apache-2.0
// Follows an opening from a point in it along the edges of the triangle beside it.
#include "gather/choose/find_gaps.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/hemisphere.h"
#include "base/random.h"
#include "gather/choose/brightness_survey.h"

namespace deltalux::gather {
namespace {

constexpr size_t kMostPassings = 256;  // examined
constexpr size_t kMostEyes = 16;       // that look through an opening
constexpr float kFirstStep = 1e-3f;    // scene metres, along an edge
constexpr int kHalvings = 6;
constexpr float kWide = 0.5f;        // largest half side, in distances of those who look
constexpr float kAround = 0.15f;     // radius, in these distances, of a disc around the opening
constexpr uint32_t kTests = 32;      // rays in that disc
constexpr uint32_t kStopped = 24;    // so many of which a wall stops
constexpr float kThick = 0.02f;      // of it, at most, in these distances
constexpr double kFilled = 0.3;      // share of a larger square that is more than a slit
constexpr float kLeast = 1e-3f;      // smallest half side, in these distances
constexpr float kSpare = 1.2f;       // times the half of what was found
constexpr size_t kMostPainted = 24;  // squares
constexpr uint32_t kLooks = 32;      // of a texel, most of which the opening fills in part
constexpr float kRise = 0.1f;        // of the half side

/// An opening, as seen from one place.
class Gap {
 public:
  Gap(const Eyes& eyes, const Passing& passing)
      : eyes_(eyes), passing_(passing), distance_(length(passing.at - passing.from)) {}

  /// Whether a wall around it, in its plane, stops most rays. Out of a niche, something small and
  /// bright is seen past corners, too.
  bool is_in_wall() const {
    Vec3f u, v;
    tangent_frame(passing_.normal, u, v);
    uint32_t stopped = 0;
    for (uint32_t k = 0; k < kTests; ++k) {
      const auto r = sobol::sample(k, eyes_.seed);
      const float away = kAround * distance_ * std::sqrt(r[0]);
      const Vec3f p = passing_.at + on_circle(u, v, r[1]) * away;
      const Vec3f w = normalize(p - passing_.from);
      const trace::Hit hit = eyes_.context.caster.closest(passing_.from, w);
      const float beyond = dot(passing_.from + w * hit.t - passing_.at, passing_.normal);
      stopped += hit.valid() && std::fabs(beyond) < kThick * distance_;
    }
    return stopped >= kStopped;
  }
  /// A square around it; none if it is too large, or no slit although it is wide.
  std::optional<Guide> square() const {
    const scene::Face face = eyes_.context.scene.face(scene::kNone, passing_.primitive);
    Box box;
    box.grow(passing_.at);
    for (int k = 0; k < 3; ++k) {
      const Vec3f along = normalize(face.corner[(k + 1) % 3] - face.corner[k]);
      for (const float sign : {1.0f, -1.0f})
        box.grow(passing_.at + along * (sign * reach(along * sign)));
    }
    Guide guide{};
    guide.normal = passing_.normal;
    guide.centre = box.centre();
    guide.half = kSpare * std::max(0.5f * box.diagonal(), kLeast * distance_);
    guide.rise = kRise * guide.half;
    if (guide.half > kWide * distance_) return std::nullopt;
    if (guide.half > kAround * distance_ && shown(guide) > kFilled) return std::nullopt;
    return guide;
  }

 private:
  /// Whether the place beyond a point of the plane is bright.
  bool shows(Vec3f p) const {
    const Vec3f d = p - passing_.from;
    const float away = length(d);
    return eyes_.radiosity(passing_.from, d * (1 / away), away) > Eyes::kBright * passing_.around;
  }
  /// The share of a square that is bright.
  double shown(const Guide& guide) const {
    uint32_t bright = 0;
    for (uint32_t k = 0; k < kTests; ++k) {
      const auto r = sobol::sample(k, eyes_.seed);
      bright += shows(guide.point(r[0], r[1]));
    }
    return double(bright) / kTests;
  }
  /// How far it extends in a direction.
  float reach(Vec3f along) const {
    float open = 0, step = kFirstStep * eyes_.context.cells.metre();
    while (step < 2 * kWide * distance_ && shows(passing_.at + along * step))
      open = step, step *= 2;
    for (int k = 0; k < kHalvings; ++k) {
      const float middle = 0.5f * (open + step);
      (shows(passing_.at + along * middle) ? open : step) = middle;
    }
    return open;
  }

  const Eyes& eyes_;
  const Passing& passing_;
  float distance_;
};

/// What rays that pass an opening by chance add to the variance of the places that look, from one
/// ray each.
double variance_of(const Eyes& eyes, const Guide& guide,
                   std::span<const direct::Receiver* const> receivers,
                   std::span<const Look> looks) {
  double sum = 0;
  for (size_t i = 0; i < looks.size(); ++i) {
    const double around = double(looks[i].around);
    const Vec3f from = Eyes::origin(*receivers[i]), n = receivers[i]->normal;
    if (!(around > 0) || !(share_of_view(guide, from, n) > 0)) continue;
    const Square square(guide);
    const auto r = sobol::sample(uint32_t(i), eyes.seed);
    const Vec3f w = square.direction(from, r[0], r[1]);
    const float cosine = dot(w, n), density = square.density(from, w);
    if (!(cosine > 0) || !(density > 0)) continue;
    const float to_plane = dot(guide.centre - from, guide.normal) / dot(w, guide.normal);
    const double share = double(eyes.radiosity(from, w, to_plane + guide.rise)) / around;
    sum += share * share * double(cosine / density) / eyes.rays;
  }
  return sum;
}

}  // namespace

bool passes(std::span<const Guide> guides, Vec3f from, Vec3f w) {
  return std::any_of(guides.begin(), guides.end(),
                     [&](const Guide& guide) { return Square(guide).density(from, w) > 0; });
}

std::vector<Guide> find_gaps(const Eyes& eyes, std::span<const direct::Receiver* const> receivers,
                             std::span<const Look> looks, size_t most, const Progress& progress) {
  std::vector<const Passing*> passings;
  double variance = 0;
  for (const Look& look : looks) {
    variance += look.variance;
    for (const Passing& own : look.passing) passings.push_back(&own);
  }
  const size_t count = std::min(passings.size(), kMostPassings);
  std::vector<Guide> gaps;
  size_t painted = 0;
  for (size_t k = 0; k < count && gaps.size() < most; ++k) {
    progress.check();
    const Passing& own = *passings[k * passings.size() / count];
    if (passes(gaps, own.from, own.at - own.from)) continue;
    const Gap gap(eyes, own);
    if (!gap.is_in_wall()) continue;
    std::optional<Guide> guide = gap.square();
    if (!guide) continue;
    std::vector<Vec3f> from;
    std::vector<float> around;
    for (const Passing* other : passings) {
      const Vec3f off = other->at - guide->centre;
      if (from.size() == kMostEyes || !(dot(off, off) < 2 * guide->half * guide->half)) continue;
      from.push_back(other->from), around.push_back(other->around);
    }
    if (from.empty()) continue;
    if (++painted > kMostPainted) break;
    guide->around = quantile(around, 0.5);
    paint(eyes, from, kLooks, *guide);
    if (guide->flaw()) continue;
    if (variance_of(eyes, *guide, receivers, looks) > BrightnessSurvey::kMinShare * variance)
      gaps.push_back(*guide);
  }
  return gaps;
}

}  // namespace deltalux::gather
