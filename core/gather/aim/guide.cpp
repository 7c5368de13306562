// SPDX-License-Identifier: Apache-2.0
// Sampling of directions towards the square of a guide.
#include "gather/aim/guide.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "base/cone.h"
#include "trace/scatter.h"

namespace deltalux::gather {

namespace {

/// Where a random number falls among cumulative probabilities: the interval, and the position in
/// [0, 1) within.
struct Fall {
  size_t interval;
  float within;
};
Fall fall(const std::array<float, Guide::kSide + 1>& cumulative, float at) {
  static_assert(std::has_single_bit(Guide::kSide));
  // the last entry not above `at`; branch-free bisection, since no predictor could guess the
  // branches
  size_t i = 0;
  for (size_t step = Guide::kSide / 2; step > 0; step /= 2)
    i += cumulative[i + step] <= at ? step : 0;
  const float low = cumulative[i], wide = cumulative[i + 1] - low;
  return {i, wide > 0 ? std::clamp((at - low) / wide, 0.0f, 0x1.fffffep-1f) : 0.5f};
}

}  // namespace

Vec3f Guide::point(float u, float v) const {
  return centre + turned({half * (2 * u - 1), half * (2 * v - 1), 0}, normal);
}

bool Guide::holds(Vec3f place) const {
  Vec3f u, v;
  tangent_frame(normal, u, v);
  const Vec3f off = place - centre;
  return std::fabs(dot(off, normal)) <= rise && std::fabs(dot(off, u)) <= half &&
         std::fabs(dot(off, v)) <= half;
}

void Guide::set_texels(const Texels& texel, bool known) {
  // of a texel, relative to the mean: it may have light that its cell does not show
  constexpr double kMinChance = 0.05;
  constexpr double kTexels = double(kSide * kSide);
  double sum = 0, squares = 0;
  for (const auto& line : texel)
    for (const float value : line) sum += double(value), squares += double(value) * double(value);
  radiosity = float(sum / kTexels), brightest = float(std::sqrt(squares / kTexels));
  // Take the maximum over neighbours: a texel across the border of two cells may be as bright as
  // the brighter one.
  const auto most_around = [&](size_t k, size_t i) {
    float most = std::max(texel[k][i], float(kMinChance * sum / kTexels));
    if (known) return most;
    for (size_t y = k > 0 ? k - 1 : 0; y < std::min(k + 2, kSide); ++y)
      for (size_t x = i > 0 ? i - 1 : 0; x < std::min(i + 2, kSide); ++x)
        most = std::max(most, texel[y][x]);
    return most;
  };
  Texels chance;
  double all = 0;
  for (size_t k = 0; k < kSide; ++k)
    for (size_t i = 0; i < kSide; ++i) all += double(chance[k][i] = most_around(k, i));
  double rows = 0;
  for (size_t k = 0; k < kSide; ++k) {
    double line = 0, before = 0;
    for (float value : chance[k]) line += double(value);
    row[k] = float(rows / all), rows += line;
    for (size_t i = 0; i < kSide; ++i)
      column[k][i] = float(before / line), before += double(chance[k][i]);
    column[k][kSide] = 1;
  }
  row[kSide] = 1;
}

const char* Guide::flaw() const {
  constexpr float kMinHalf = 1e-12f;  // its square is not 0 in single precision
  // sums of shares stay finite, whatever other guides there are
  constexpr float kMaxContrast = 1e12f;
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::fabs(centre[axis]) <= kFarthest)) return "a place that is not finite";
  if (!is_unit(normal)) return "a normal that is not of unit length";
  if (!(half >= kMinHalf && half <= kFarthest)) return "a size that no scene has";
  if (!(rise > 0 && rise <= half)) return "a rise beyond its size";
  for (float value : {radiosity, brightest, around})
    if (!(value > 0 && std::isfinite(value))) return "light that is not positive and finite";
  if (!(std::max(radiosity, brightest) / around <= kMaxContrast))
    return "light too bright for its surroundings";
  const auto off = [](const std::array<float, kSide + 1>& chances) {
    for (size_t i = 0; i < kSide; ++i)
      if (!(chances[i] <= chances[i + 1])) return true;
    return chances.front() != 0 || chances.back() != 1;
  };
  if (off(row) || std::any_of(column.begin(), column.end(), off))
    return "chances that do not grow from 0 to 1";
  return nullptr;
}

Vec3f Square::direction(Vec3f from, float u, float v) const {
  const Fall row = fall(guide_->row, v), column = fall(guide_->column[row.interval], u);
  const auto place = [&](const Fall& f) {
    return guide_->half * (2 * (float(f.interval) + f.within) / Guide::kSide - 1);
  };
  Vec3f along_row, along_column;
  tangent_frame(guide_->normal, along_row, along_column);
  const Vec3f d = guide_->centre - from + along_row * place(column) + along_column * place(row);
  const float distance = length(d);
  return distance > 0 ? d * (1 / distance) : Vec3f{};
}

float Square::density(Vec3f from, Vec3f w) const {
  const Vec3f to_centre = guide_->centre - from;
  const float along = dot(w, guide_->normal);
  const float t = along != 0 ? dot(to_centre, guide_->normal) / along : 0.0f;
  if (!(t > 0)) return 0;
  const Vec3f off = w * t - to_centre;
  const float half = guide_->half;
  // squared, in units of the half side; includes a margin for rounding
  constexpr float kCorner = 2.01f;
  if (!(dot(off, off) < kCorner * half * half)) return 0;
  Vec3f u, v;
  tangent_frame(guide_->normal, u, v);
  const float x = dot(off, u) + half, y = dot(off, v) + half;
  if (!(x >= 0 && x < 2 * half && y >= 0 && y < 2 * half)) return 0;
  const float texel = 2 * half / Guide::kSide;
  const size_t i = std::min(size_t(x / texel), Guide::kSide - 1);
  const size_t k = std::min(size_t(y / texel), Guide::kSide - 1);
  const float chance =
      (guide_->row[k + 1] - guide_->row[k]) * (guide_->column[k][i + 1] - guide_->column[k][i]);
  return std::numbers::pi_v<float> * chance * t * t / (std::fabs(along) * texel * texel);
}

bool Square::may_meet(Vec3f from, Vec3f to_ball, float radius) const {
  const Vec3f to_centre = guide_->centre - from;
  const float distance = length(to_centre);
  const float around = 1.5f * guide_->half;  // a little more than the distance to the corners
  if (!(distance > around)) return true;
  const float sine = around / distance;
  const Cone cone{to_centre * (1 / distance), std::sqrt(1 - sine * sine), sine};
  return cone.may_meet(to_ball, radius);
}

Expected Square::expected(Vec3f from, Vec3f n) const {
  const float view = share_of_view(*guide_, from, n);
  return {guide_->brightest * guide_->brightest * view, guide_->radiosity * view, guide_->around};
}

float Square::share(Vec3f from, Vec3f n) const {
  return guide_->radiosity / guide_->around * share_of_view(*guide_, from, n);
}

void Square::look(uint32_t k, const PathRandom& random, VisibilityTest& test,
                  uint32_t& seen) const {
  const Vec3f w = direction(test.from(), random(k, 0), random(k, 1));
  if (!(dot(w, test.normal()) > 0)) return;
  // Shorten the ray to where it comes close to the guide's plane.
  const float along = dot(w, guide_->normal);
  const float near = std::fabs(dot(guide_->centre - test.from(), guide_->normal)) - guide_->rise;
  test.add(w * (std::max(near, 0.0f) / std::fabs(along)), seen);
}

}  // namespace deltalux::gather
