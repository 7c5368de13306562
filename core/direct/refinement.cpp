// SPDX-License-Identifier: Apache-2.0
// Floods the edges of what is visible of a light with rays.
#include "direct/refinement.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace deltalux::direct {
namespace {

using trace::RayBits;

// The variance of one ray in a stratum is half the mean squared difference from its neighbours
// where visibility is random from stratum to stratum, and half of that where a straight edge
// passes.
constexpr double kEdgeVariance = 0.75 * 0.5;

// A smaller share than this may have parts without a ray.
constexpr double kSliver = 1.0 / 16;

bool has(const RayBits& bits, size_t i) { return bits[i / 64] >> (i % 64) & 1; }

/// Calls each(j) for the strata j beside stratum i of a grid, column by column.
template <class Each>
void each_beside(size_t i, size_t rows, size_t count, const Each& each) {
  const size_t row = i % rows;
  if (row > 0) each(i - 1);
  if (row + 1 < rows) each(i + 1);
  if (i >= rows) each(i - rows);
  if (i + rows < count) each(i + rows);
}

/// As each_beside(), with those that touch at a corner.
template <class Each>
void each_around(size_t i, size_t rows, size_t count, const Each& each) {
  each_beside(i, rows, count, each);
  for (const size_t column : {i - rows, i + rows}) {
    if (column >= count) continue;  // also below 0
    if (i % rows > 0) each(column - 1);
    if (i % rows + 1 < rows) each(column + 1);
  }
}

/// Sum of the squared weights of the rays `first` to `first + count`, a grid, times the share of
/// their neighbours from which their visibility differs.
double edges(const Strata& rays, const RayBits& free, size_t first, size_t count, size_t rows) {
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    if (!has(rays.countable, first + i)) continue;
    int beside = 0, others = 0;
    each_beside(i, rows, count, [&](size_t j) {
      if (!has(rays.countable, first + j)) return;
      ++beside;
      others += has(free, first + j) != has(free, first + i);
    });
    const double weight = rays.weight[first + i];
    if (others) sum += weight * weight * others / beside;
  }
  return sum;
}

/// What is known of the fine strata.
class Survey {
 public:
  Survey(const Strata& fine, const RayBits& free) : rows_(fine.rows) {
    for (size_t i = 0; i < kFineRays; ++i) {
      if (!has(fine.countable, i)) continue;
      all_[i] = fine.weight[i];
      lit_[i] = has(free, i) ? fine.weight[i] : 0.0f;
    }
  }
  /// The strata that are to be divided next, at most kDivided; marks them as divided.
  std::vector<uint32_t> next(bool every) {
    std::vector<uint32_t> out;
    for (uint32_t i = 0; i < kFineRays && out.size() < kDivided; ++i) {
      if (divided_[i] || !(all_[i] > 0)) continue;
      bool edge = every;
      each_around(i, rows_, kFineRays, [&](size_t j) {
        edge |= all_[j] > 0 && (is_mixed(j) || is_lit(j) != is_lit(i));
      });
      if (edge) out.push_back(i);
    }
    for (const uint32_t i : out) divided_[i] = true;
    return out;
  }
  void divide(const std::vector<uint32_t>& strata, const Strata& rays, const RayBits& free) {
    constexpr size_t kRays = kParts * kParts;
    for (size_t k = 0; k < strata.size(); ++k) {
      float all = 0, lit = 0;
      for (size_t i = k * kRays; i < (k + 1) * kRays; ++i) {
        if (has(rays.countable, i)) all += rays.weight[i];
        if (has(free, i)) lit += rays.weight[i];
      }
      all_[strata[k]] = all / kRays, lit_[strata[k]] = lit / kRays;
      edges_ += edges(rays, free, k * kRays, kRays, kParts) / (kRays * kRays);
    }
  }
  Seen seen() const {
    double all = 0, lit = 0;
    for (size_t i = 0; i < kFineRays; ++i) all += all_[i], lit += lit_[i];
    if (!(all > 0)) return {};
    return {std::min(lit / all, 1.0), float(std::sqrt(edges_ * kEdgeVariance) / all)};
  }

 private:
  bool is_lit(size_t i) const { return lit_[i] > 0; }
  bool is_mixed(size_t i) const { return lit_[i] > 0 && lit_[i] < all_[i]; }

  size_t rows_;
  double edges_ = 0;
  std::array<float, kFineRays> all_{}, lit_{};  // weight of the stratum and of what is visible
  std::array<bool, kFineRays> divided_{};
};

}  // namespace

Seen by_strata(const Strata& fine, const RayBits& free) {
  double all = 0;
  for (size_t i = 0; i < fine.fan.count; ++i)
    if (has(fine.countable, i)) all += fine.weight[i];
  if (!(all > 0)) return {};
  const double sum = edges(fine, free, 0, fine.fan.count, fine.rows);
  return {fine.share(free), float(std::sqrt(sum * kEdgeVariance) / all)};
}

Seen refine(const LightShape& light, const Receiver& receiver, const Strata& fine,
            const RayBits& free, const FreeRays& free_rays) {
  Survey survey(fine, free);
  const bool every = fine.share(free) < kSliver;
  Strata rays;
  for (std::vector<uint32_t> strata = survey.next(every); !strata.empty();
       strata = survey.next(every)) {
    light.divide(receiver, strata, rays);
    survey.divide(strata, rays, free_rays(rays));
  }
  return survey.seen();
}

}  // namespace deltalux::direct
