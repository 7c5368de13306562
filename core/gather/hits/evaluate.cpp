// SPDX-License-Identifier: Apache-2.0
// Computes gathered irradiance and its standard error, with one look-up per ray.
#include "gather/hits/evaluate.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"

namespace deltalux::gather {
namespace {

// Number of samples from which learn_spread() learns.
constexpr size_t kPupils = 2048;
constexpr size_t kMinPupils = 64;  // of a kind; fewer tell nothing
// Of fewer batches with light, each may have had it from one path: others, which keep more of their
// power, may be missing. So they may where most rays end in darkness.
constexpr size_t kFewBatches = 4;
constexpr double kMostReflected = 0.95;  // of what a room's surfaces reflect, in that allowance
constexpr double kMaxRelative = 0.04;    // variance: beyond, the noise may stem from a single ray
// A ray is lucky if it brings this share of the light, or that of so many of the sample's rays.
constexpr double kLucky = 1.0 / 16, kLuckyRays = 16;

/// Variances of the mean of a matrix whose rows and columns are drawn at random (two-way analysis
/// of variance): `rows` and `columns` are the variances between row means and between column means,
/// each of which includes `rest`, that of the residuals.
struct Variances {
  double rows = 0, columns = 0, rest = 0;
  /// variance of the mean over rows, from the difference of two halves of the rows
  double halves = 0;
};
template <size_t N>
Variances crossed_variances(const double (&x)[N][N]) {
  double row[N] = {}, column[N] = {}, all = 0, half[2] = {};
  for (size_t i = 0; i < N; ++i)
    for (size_t k = 0; k < N; ++k) row[i] += x[i][k] / N, column[k] += x[i][k] / N;
  for (size_t i = 0; i < N; ++i) all += row[i] / N, half[2 * i / N] += row[i] / (0.5 * N);
  Variances out;
  for (size_t i = 0; i < N; ++i) {
    out.rows += (row[i] - all) * (row[i] - all);
    out.columns += (column[i] - all) * (column[i] - all);
    for (size_t k = 0; k < N; ++k) {
      const double off = x[i][k] - row[i] - column[k] + all;
      out.rest += off * off;
    }
  }
  out.rows /= N * (N - 1.0), out.columns /= N * (N - 1.0);
  out.rest /= N * N * (N - 1.0) * (N - 1.0);
  out.halves = 0.25 * (half[0] - half[1]) * (half[0] - half[1]);
  return out;
}

}  // namespace

Evaluation::Evaluation(const CellState& state, const CellLight& light, Paint paint, bool errors,
                       const Workers& workers)
    : cells_(&state.cells), light_(&light), paint_(std::move(paint)) {
  if (state.sums.batches != kParts) throw Error("gather: batches and parts of rays differ");
  if (!errors) return;
  batches_ = batches_of(state, workers);
  double area = 0;
  for (uint32_t cell = 0; cell < state.cells.size(); ++cell) {
    const double own = state.cells.area(cell);
    area += own;
    for (size_t c = 0; c < 3; ++c) mean_radiosity_[c] += own * double(light[cell][c]);
  }
  for (double& value : mean_radiosity_) value = area > 0 ? value / area : 0.0;
}

float Evaluation::brightness(uint32_t cell) const {
  const CellLight::Radiosity& own = (*light_)[cell];
  return own[0] + own[1] + own[2];
}

void Evaluation::Table::means(size_t channel, double (&out)[kParts][kParts]) const {
  for (size_t part = 0; part < kParts; ++part)
    for (size_t k = 0; k < kParts; ++k)
      out[part][k] = double(sums[part][channel][k]) / double(rays[part]);
}

double Evaluation::Table::lucky_variance(size_t channel, size_t count) const {
  const double least = std::max(kLucky, kLuckyRays / double(count)) * whole[channel];
  double squares = 0;
  for (const auto& of_part : most)
    if (const double own = of_part[channel]; own > 0 && own >= least) squares += own * own;
  return squares / (double(count) * double(count));
}

size_t Evaluation::kind_of(const Table& table, size_t rays) {
  return 20 * table.chains < rays ? 0 : 2 * table.chains < rays ? 1 : 2;
}

void Evaluation::learn_spread(const GatherHits& hits) {
  std::array<double, kKinds> parts{}, halves{};
  std::array<size_t, kKinds> count{};
  const size_t step = (hits.samples() + kPupils - 1) / kPupils;
  for (size_t sample = 0; sample < hits.samples(); sample += step) {
    Table table;
    add<true>(hits, sample, table);
    const size_t n = hits.targets(sample).size(), kind = kind_of(table, n);
    ++count[kind];
    for (size_t c = 0; c < 3; ++c) {
      const double mean = table.whole[c] / double(n);
      double means[kParts][kParts];
      table.means(c, means);
      const Variances own = crossed_variances(means);
      if (!(mean > 0) || own.rows > kMaxRelative * mean * mean) continue;
      parts[kind] += (own.rows - own.rest) / (mean * mean);
      halves[kind] += (own.halves - own.rest) / (mean * mean);
    }
  }
  // From eight parts to two halves, the number of rays doubles twice; to the whole, three times.
  for (size_t kind = 0; kind < kKinds; ++kind)
    if (count[kind] >= kMinPupils && parts[kind] > 0)
      evenness_[kind] = std::pow(std::clamp(halves[kind] / parts[kind], 0.1, 1.0), 1.5);
}

SampleLight Evaluation::read(const GatherHits& hits, size_t sample) const {
  const size_t n = hits.targets(sample).size();
  SampleLight out;
  Table table;
  if (batches_.empty())
    add<false>(hits, sample, table);
  else
    add<true>(hits, sample, table);
  for (size_t c = 0; c < 3; ++c) out.irradiance[c] = table.whole[c] / double(n);
  if (batches_.empty()) return out;
  const double evenness = evenness_[kind_of(table, n)];
  std::optional<Vec3d> of_one_path;
  for (size_t c = 0; c < 3; ++c) {
    double means[kParts][kParts];
    table.means(c, means);
    const Variances own = crossed_variances(means);
    const double variance = evenness * (own.rows - own.rest) + own.columns;
    const double least = 0.25 * std::max(evenness * own.rows, own.columns);
    // In darkness, as if one more ray had met a surface of mean radiosity.
    out.error[c] = out.irradiance[c] > 0 ? std::sqrt(std::max(variance, least))
                                         : mean_radiosity_[c] / double(n);
    out.lucky[c] = table.lucky_variance(c, n);
    size_t reached = 0;  // batches
    for (size_t k = 0; k < kParts; ++k) {
      double sum = 0;
      for (size_t part = 0; part < kParts; ++part) sum += means[part][k];
      reached += sum > 0;
    }
    // What is seen through an opening says nothing of a room whose own surfaces are not lit.
    const bool hardly = reached < kFewBatches || 2 * table.unlit > n;
    if (reached == 0 || !hardly) continue;
    if (!of_one_path) of_one_path = unseen(hits, sample);
    out.error[c] = std::hypot(out.error[c], (*of_one_path)[int(c)]);
  }
  return out;
}

Vec3d Evaluation::unseen(const GatherHits& hits, size_t sample) const {
  const std::span<const uint32_t> targets = hits.targets(sample);
  Vec3d sum{};
  for (const uint32_t target : targets) {
    const uint32_t cell = GatherHits::is_chain(target)
                              ? hits.chains().sent(GatherHits::chain_of(target)).end
                              : target;
    if (cell == kDark) continue;
    const uint32_t material = cells_->material(cell);
    sum = sum + Vec3d(surfaces::tinted(paint_.reflectance[material], paint_.contrast[material],
                                       cells_->tint(cell)));
  }
  for (int c = 0; c < 3; ++c) {
    const double mean = std::min(sum[c] / double(targets.size()), kMostReflected);
    sum[c] = one_path_[c] * mean / (1 - mean);
  }
  return sum;
}

PilotEstimate Evaluation::pilot(const GatherHits& hits, size_t sample) const {
  Table table;
  add<false>(hits, sample, table);
  double sum = 0, squares = 0;
  for (size_t part = 0; part < kParts; ++part) {
    const auto& own = table.parts[part];
    const double mean =
        (double(own[0]) + double(own[1]) + double(own[2])) / double(table.rays[part]);
    sum += mean, squares += mean * mean;
  }
  const double mean = sum / kParts;
  const double variance = std::max(0.0, squares / kParts - mean * mean) / (kParts - 1.0);
  return {float(mean), float(variance)};
}

template <bool kErrors>
void Evaluation::add(const GatherHits& hits, size_t sample, Table& table) const {
  const std::span<const uint32_t> targets = hits.targets(sample);
  const std::span<const float> weights = hits.weights(sample);
  const size_t n = targets.size();
  for (size_t part = 0; part < kParts; ++part) {
    const size_t first = n * part / kParts, last = n * (part + 1) / kParts;
    table.rays[part] = std::max<size_t>(1, last - first);
    float of_part[3] = {}, most[3] = {};
    auto& by_batch = table.sums[part];
    for (size_t ray = first; ray < last; ++ray) {
      const uint32_t target = targets[ray];
      if (target == kDark) continue;
      const float weight = weights.empty() ? 1.0f : weights[ray];
      std::array<float, 3> through{weight, weight, weight}, brought{};
      uint32_t cell = target;
      if (GatherHits::is_chain(target)) {
        const ChainPool::Sent& sent = hits.chains().sent(GatherHits::chain_of(target));
        ++table.chains;
        cell = sent.end;
        for (size_t c = 0; c < 3; ++c) {
          through[c] = weight * sent.through[c];
          const float direct = weight * sent.direct[c];
          of_part[c] += direct;
          brought[c] = direct;
          if (kErrors) most[c] = std::max(most[c], direct);
          for (size_t k = 0; kErrors && k < kParts; ++k) by_batch[c][k] += direct;
        }
        if (cell == kDark) continue;
      }
      const CellLight::Radiosity& radiosity = (*light_)[cell];
      table.unlit += !(radiosity[0] + radiosity[1] + radiosity[2] > 0);
      for (size_t c = 0; c < 3; ++c) {
        of_part[c] += through[c] * radiosity[c];
        if (!kErrors) continue;
        most[c] = std::max(most[c], brought[c] + through[c] * radiosity[c]);
        const CellBatches& own = batches_[cell];
        const float step = through[c] * own.step;
        for (size_t k = 0; k < kParts; ++k) by_batch[c][k] += step * float(int(own.steps[c][k]));
      }
    }
    for (size_t c = 0; c < 3; ++c) table.most[part][c] = most[c];
    for (size_t c = 0; c < 3; ++c) table.whole[c] += double(table.parts[part][c] = of_part[c]);
  }
}

}  // namespace deltalux::gather
