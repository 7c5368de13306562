// SPDX-License-Identifier: Apache-2.0
// One look-up a ray.
#include "gather/evaluate.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace deltalux::gather {
namespace {

constexpr size_t kRow = 4;  // three channels and padding
constexpr float kNothing[9 * kRow] = {};

/// Variance of the mean of all entries, rows and columns both drawn at random: what rows share,
/// what columns share, and the rest, which both estimates count (two-way analysis of variance).
template <size_t N>
double crossed_variance(const double (&x)[N][N]) {
  double row[N] = {}, column[N] = {}, all = 0;
  for (size_t i = 0; i < N; ++i)
    for (size_t k = 0; k < N; ++k) row[i] += x[i][k] / N, column[k] += x[i][k] / N;
  for (size_t i = 0; i < N; ++i) all += row[i] / N;
  double rows = 0, columns = 0, rest = 0;
  for (size_t i = 0; i < N; ++i) {
    rows += (row[i] - all) * (row[i] - all);
    columns += (column[i] - all) * (column[i] - all);
    for (size_t k = 0; k < N; ++k) {
      const double off = x[i][k] - row[i] - column[k] + all;
      rest += off * off;
    }
  }
  rows /= N * (N - 1.0), columns /= N * (N - 1.0), rest /= N * N * (N - 1.0) * (N - 1.0);
  return std::max(rows + columns - rest, 0.25 * std::max(rows, columns));
}

}  // namespace

Evaluation::Evaluation(const scene::Scene& scene, std::span<const trace::Light> lights,
                       const Cells& cells, const Coverage& coverage, const CellSums& sums,
                       const Scales& scales, const Workers& workers)
    : scene_(scene), lights_(lights), scales_(scales) {
  if (sums.batches != kParts) throw Error("gather: batches and parts of rays differ");
  radiosity_.assign(size_t(cells.size()) * (kParts + 1) * kRow, 0.0f);
  workers.for_blocks(cells.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t cell = begin; cell < end; ++cell) {
      const double area = double(cells.area(uint32_t(cell))) * coverage.bare(uint32_t(cell));
      if (!(area > 0)) continue;
      const Vec3f reflectance = scene.materials[cells.material(uint32_t(cell))].reflectance;
      float* row = &radiosity_[cell * (kParts + 1) * kRow];
      for (size_t c = 0; c < 3; ++c) {
        const double unit = scales.quantum * double(reflectance[int(c)]) / area;
        double all = 0;
        for (uint32_t k = 0; k < kParts; ++k) {
          double own = 0;
          for (uint32_t g = 0; g < sums.groups; ++g)
            own += scales.sum_factor[g] * double(sums.quanta[sums.at(uint32_t(cell), g, k) + c]);
          row[k * kRow + c] = float(own * unit * kParts);
          all += own;
        }
        row[kParts * kRow + c] = float(all * unit);
      }
    }
  });
  double area = 0;
  for (uint32_t cell = 0; cell < cells.size(); ++cell) {
    const double own = cells.area(cell);
    area += own;
    for (size_t c = 0; c < 3; ++c)
      mean_radiosity_[c] +=
          own * double(radiosity_[(size_t(cell) * (kParts + 1) + kParts) * kRow + c]);
  }
  for (double& value : mean_radiosity_) value = area > 0 ? value / area : 0.0;
}

float Evaluation::brightness(uint32_t cell) const {
  const float* row = &radiosity_[(size_t(cell) * (kParts + 1) + kParts) * kRow];
  return row[0] + row[1] + row[2];
}

void Evaluation::add(const ChainPool& chains, uint32_t target, float weight, float* sums) const {
  if (target == kDark) return;
  if (!Looks::is_chain(target)) {
    const float* row = &radiosity_[size_t(target) * (kParts + 1) * kRow];
    for (size_t i = 0; i < (kParts + 1) * kRow; ++i) sums[i] += weight * row[i];
    return;
  }
  const uint32_t chain = Looks::chain_of(target), end = chains.end(chain);
  float direct[3] = {}, through[3] = {weight, weight, weight};
  uint32_t number = 0;
  for (const Vertex& vertex : chains.vertices(chain)) {
    const Vec3f reflectance = scene_.materials[vertex.material].reflectance;
    const float dim = vertex.light == scene::kNone
                          ? 0.0f
                          : float(scales_.dim_factor[lights_[vertex.light].group]);
    const float chance = number++ >= kSurely ? 1 / kGoesOn : 1.0f;
    for (size_t c = 0; c < 3; ++c) {
      through[c] *= reflectance[int(c)] * chance;
      direct[c] += through[c] * vertex.direct[c] * dim;
    }
  }
  for (float& own : through) own *= chains.weight(chain);
  const float* row = end == kDark ? kNothing : &radiosity_[size_t(end) * (kParts + 1) * kRow];
  for (size_t part = 0; part <= kParts; ++part)
    for (size_t c = 0; c < 3; ++c)
      sums[part * kRow + c] += direct[c] + through[c] * row[part * kRow + c];
}

void Evaluation::read(const Looks& looks, size_t sample, double* irradiance, double* error) const {
  const std::span<const uint32_t> targets = looks.targets(sample);
  const std::span<const float> weights = looks.weights(sample);
  const size_t n = targets.size();
  // By part of the rays and batch of the paths, the last one in all. Each part is a run of the
  // Sobol' sequence, evenly spread by itself.
  float sums[kParts][(kParts + 1) * kRow] = {};
  size_t rays[kParts];
  for (size_t part = 0; part < kParts; ++part) {
    const size_t first = n * part / kParts, last = n * (part + 1) / kParts;
    for (size_t ray = first; ray < last; ++ray)
      add(looks.chains(), targets[ray], weights.empty() ? 1.0f : weights[ray], sums[part]);
    rays[part] = std::max<size_t>(1, last - first);
  }
  for (size_t c = 0; c < 3; ++c) {
    double all = 0, mean[kParts][kParts];
    for (size_t part = 0; part < kParts; ++part) {
      all += double(sums[part][kParts * kRow + c]);
      for (size_t k = 0; k < kParts; ++k)
        mean[part][k] = double(sums[part][k * kRow + c]) / double(rays[part]);
    }
    irradiance[c] = all / double(n);
    // Dark: as if one more ray had met a surface of mean brightness.
    error[c] = all > 0 ? std::sqrt(crossed_variance(mean)) : mean_radiosity_[c] / double(n);
  }
}

}  // namespace deltalux::gather
