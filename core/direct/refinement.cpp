// SPDX-License-Identifier: Apache-2.0
// Floods the edges of what is visible of a light with rays.
#include "direct/refinement.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
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

// Parts of strata that are divided in turn. Where more are at an edge, many are lit, and the error
// is small.
constexpr size_t kMostParts = 1024;

// Relative error from which on cells are divided.
constexpr double kRough = 0.04;

bool has(const RayBits& bits, size_t i) { return bits[i / 64] >> (i % 64) & 1; }

/// Calls each(j) for the cells j around cell i of a grid, column by column.
template <class Each>
void each_around(size_t i, size_t rows, size_t count, const Each& each) {
  const bool below = i % rows > 0, above = i % rows + 1 < rows;
  for (const size_t column : {i - rows, i, i + rows}) {
    if (column >= count) continue;  // also below 0
    if (below) each(column - 1);
    if (column != i) each(column);
    if (above) each(column + 1);
  }
}

/// Sum of the squared weights of the rays `first` to `first + count`, a grid, times the share of
/// their neighbours from which their visibility differs. A neighbour is the next ray of the row or
/// column that counts.
double edges(const Strata& rays, const RayBits& free, size_t first, size_t count, size_t rows) {
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    if (!has(rays.countable, first + i)) continue;
    int beside = 0, others = 0;
    const auto look = [&](size_t steps, ptrdiff_t step) {
      size_t j = i;
      while (steps--) {
        j += size_t(step);
        if (!has(rays.countable, first + j)) continue;
        ++beside;
        others += has(free, first + j) != has(free, first + i);
        return;
      }
    };
    look(i % rows, -1), look(rows - 1 - i % rows, 1);
    look(i / rows, -ptrdiff_t(rows)), look((count - 1 - i) / rows, ptrdiff_t(rows));
    const double weight = rays.weight[first + i];
    if (others) sum += weight * weight * others / beside;
  }
  return sum;
}

constexpr size_t kRays = kParts * kParts;     // of a cell that is divided
constexpr size_t kCells = kFineRays * kRays;  // parts of all fine strata

/// Weight of some cells, what is visible of it, and the variance of that.
struct Sums {
  double all = 0, lit = 0, variance = 0;
  Seen seen() const {
    if (!(all > 0)) return {};
    return {std::clamp(lit / all, 0.0, 1.0), float(std::sqrt(variance) / all)};
  }
};

/// Cells of a light: a grid, column by column. Each is lit, dark, or both once it has been divided.
template <size_t kCount>
class Survey {
 public:
  /// `near`: cells of a light of many triangles are neighbours up to this squared distance,
  /// wherever they lie in the grid; 0: only those of the grid are.
  Survey(size_t rows, float near) : rows_(rows), near_(near) {}

  /// Counts cells by one ray, number `ray`. It may face away though other points of the cell do
  /// not: then only parts tell what the cell is.
  void set(size_t cell, const Strata& rays, const RayBits& free, size_t ray) {
    known_[cell] = has(rays.nearly, ray);
    if (has(rays.countable, ray)) all_[cell] = rays.weight[ray];
    if (has(free, ray)) lit_[cell] = rays.weight[ray];
    x_[cell] = rays.fan.x[ray], y_[cell] = rays.fan.y[ray], z_[cell] = rays.fan.z[ray];
  }
  /// Finds the cells beside which visibility changes.
  void find_edges() {
    size_t lit = 0, known = 0;
    for (size_t i = 0; i < kCount; ++i) known += known_[i], lit += is_lit(i);
    const bool minority = 2 * lit < known;
    for (size_t i = 0; i < kCount; ++i)
      if (known_[i] && is_lit(i) == minority)
        each_near(i, [&](size_t j) {
          if (is_lit(j) != minority) edge_[i] = edge_[j] = true;
        });
  }
  /// Counts a cell by its parts, which are the rays from `first` on.
  void divide(size_t cell, const Strata& rays, const RayBits& free, size_t first) {
    float all = 0, lit = 0;
    for (size_t i = first; i < first + kRays; ++i) {
      if (has(rays.countable, i)) all += rays.weight[i];
      if (has(free, i)) lit += rays.weight[i];
    }
    all_[cell] = all / kRays, lit_[cell] = lit / kRays;
    variance_ += kEdgeVariance * edges(rays, free, first, kRays, kParts) / (kRays * kRays);
    const bool mixed = lit > 0 && lit < all;
    each_near(cell, [&](size_t j) { edge_[j] |= mixed || is_lit(j) != is_lit(cell); });
  }
  /// The cells at edges that are not divided, at most `most`; or all that are not divided. They
  /// count as divided from now on.
  std::vector<uint32_t> next(size_t most, bool every = false) {
    std::vector<uint32_t> out;
    for (uint32_t i = 0; i < kCount && out.size() < most; ++i)
      if (known_[i] && !divided_[i] && (every || edge_[i])) out.push_back(i);
    for (const uint32_t i : out) divided_[i] = true;
    return out;
  }
  /// Corrects what is visible of the cells that are not divided.
  void add(double lit, double variance) { more_ += lit, more_variance_ += variance; }
  bool is_lit(size_t i) const { return lit_[i] > 0; }
  /// Whether the cell is known by one ray.
  bool is_whole(size_t i) const { return all_[i] > 0 && !divided_[i]; }
  Sums sums() const {
    Sums out = whole();
    for (size_t i = 0; i < kCount; ++i)
      if (divided_[i]) out.all += all_[i], out.lit += lit_[i];
    out.variance += variance_;
    return out;
  }
  /// Of the cells that are not divided.
  Sums whole() const {
    Sums out{0, more_, more_variance_};
    for (size_t i = 0; i < kCount; ++i)
      if (!divided_[i]) out.all += all_[i], out.lit += lit_[i];
    return out;
  }

 private:
  template <class Each>
  void each_near(size_t cell, const Each& each) const {
    each_around(cell, rows_, kCount, [&](size_t j) {
      if (known_[j]) each(j);
    });
    if (!(near_ > 0)) return;
    std::array<float, kCount> squared;
    for (size_t j = 0; j < kCount; ++j) {
      const float x = x_[j] - x_[cell], y = y_[j] - y_[cell], z = z_[j] - z_[cell];
      squared[j] = x * x + y * y + z * z;
    }
    for (size_t j = 0; j < kCount; ++j)
      if (squared[j] < near_ && known_[j] && j != cell) each(j);
  }

  size_t rows_;
  float near_;
  double variance_ = 0, more_ = 0, more_variance_ = 0;
  std::array<float, kCount> x_{}, y_{}, z_{};  // from the receiver
  std::array<float, kCount> all_{}, lit_{};    // weight of the cell, and of what is visible
  std::array<bool, kCount> known_{}, edge_{}, divided_{};
};

/// The fine strata of a light, and the parts of those that are divided.
class Parts {
 public:
  Parts(const LightShape& light, const Receiver& receiver, const FreeRays& free_rays, size_t rows)
      : light_(light),
        receiver_(receiver),
        free_rays_(free_rays),
        rows_(rows),
        strata_(rows, light.near(kFineRays)),
        cells_(rows * kParts, light.near(kCells)) {}

  /// Divides strata.
  Seen divide_strata(const Strata& fine, const RayBits& free) {
    std::vector<uint32_t> all(kFineRays);
    std::iota(all.begin(), all.end(), 0u);
    light_.divide(receiver_, {all, 0, 1}, rays_);
    rays_.countable = fine.countable;  // of the rays that were cast
    for (const uint32_t i : all) strata_.set(i, rays_, free, i);
    const bool every = fine.share(free) < kSliver;
    if (!every) strata_.find_edges();
    for (auto next = strata_.next(kDivided, every); !next.empty();
         next = strata_.next(kDivided, every)) {
      const RayBits seen = cast({next, 0, kParts});
      for (size_t k = 0; k < next.size(); ++k) {
        strata_.divide(next[k], rays_, seen, k * kRays);
        for (size_t part = 0; part < kRays; ++part)
          cells_.set(place(next[k], part), rays_, seen, k * kRays + part);
      }
    }
    if (!every) ask_again(strata_, 0);
    return strata_.sums().seen();
  }
  /// Divides parts of divided strata; nullopt if there are too many.
  std::optional<Seen> divide_parts() {
    size_t count = 0;
    cells_.find_edges();
    for (auto next = cells_.next(kDivided); !next.empty(); next = cells_.next(kDivided)) {
      if ((count += next.size()) > kMostParts) return std::nullopt;
      const RayBits seen = cast({next, 1, kParts});
      for (size_t k = 0; k < next.size(); ++k) cells_.divide(next[k], rays_, seen, k * kRays);
    }
    ask_again(cells_, 1);
    const Sums whole = strata_.whole(), parts = cells_.sums();
    return Sums{whole.all + parts.all / kRays, whole.lit + parts.lit / kRays,
                whole.variance + parts.variance / (kRays * kRays)}
        .seen();
  }

 private:
  /// The cell of a stratum's part in the grid of all parts.
  size_t place(size_t stratum, size_t part) const {
    const size_t column = stratum / rows_ * kParts + part / kParts;
    return column * rows_ * kParts + stratum % rows_ * kParts + part % kParts;
  }
  RayBits cast(const LightShape::Cells& cells) {
    light_.divide(receiver_, cells, rays_);
    return free_rays_(rays_);
  }
  /// Cells were divided where one ray told a difference, so what the others told is no longer right
  /// on average: an opening smaller than a cell is resolved if a ray passed, and dark if none did.
  /// What another ray tells of them is right.
  template <size_t kCount>
  void ask_again(Survey<kCount>& survey, uint32_t depth) {
    std::vector<uint32_t> whole;
    for (uint32_t i = 0; i < kCount; ++i)
      if (survey.is_whole(i)) whole.push_back(i);
    for (size_t first = 0; first < whole.size(); first += kFineRays) {
      const std::span some =
          std::span(whole).subspan(first).first(std::min<size_t>(kFineRays, whole.size() - first));
      const RayBits seen = cast({some, depth, 1});
      for (size_t k = 0; k < some.size(); ++k) {
        if (!has(rays_.countable, k) || has(seen, k) == survey.is_lit(some[k])) continue;
        const double weight = rays_.weight[k];
        survey.add(has(seen, k) ? weight : -weight, weight * weight);
      }
    }
  }

  const LightShape& light_;
  const Receiver& receiver_;
  const FreeRays& free_rays_;
  size_t rows_;
  Strata rays_;
  Survey<kFineRays> strata_;
  Survey<kCells> cells_;
};

}  // namespace

bool is_rough(const Seen& seen) { return seen.share > 0 && seen.error > kRough * seen.share; }

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
  Parts parts(light, receiver, free_rays, fine.rows);
  const Seen seen = parts.divide_strata(fine, free);
  if (seen.share > 0 && !is_rough(seen)) return seen;
  return parts.divide_parts().value_or(seen);
}

}  // namespace deltalux::direct
