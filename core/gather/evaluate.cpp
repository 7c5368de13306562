// SPDX-License-Identifier: Apache-2.0
// One look-up a ray.
#include "gather/evaluate.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace deltalux::gather {
namespace {

constexpr double kSteps = 65535;

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
                       const Scales& scales, bool errors, const Workers& workers) {
  if (sums.batches != kParts) throw Error("gather: batches and parts of rays differ");
  for (const scene::Material& material : scene.materials)
    reflectance_.push_back(material.reflectance);
  for (const trace::Light& light : lights) dim_.push_back(float(scales.dim_factor[light.group]));
  dim_.push_back(0);
  whole_.assign(cells.size(), {});
  if (errors) batches_.assign(cells.size(), {});
  workers.for_blocks(cells.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t cell = begin; cell < end; ++cell) {
      const double area = double(cells.area(uint32_t(cell))) * coverage.bare(uint32_t(cell));
      if (!(area > 0)) continue;
      const Vec3f reflectance = scene.materials[cells.material(uint32_t(cell))].reflectance;
      double batch[kParts][3] = {}, most = 0;
      for (size_t c = 0; c < 3; ++c) {
        const double unit = scales.quantum * double(reflectance[int(c)]) / area;
        double all = 0;
        for (uint32_t k = 0; k < kParts; ++k) {
          double own = 0;
          for (uint32_t g = 0; g < sums.groups; ++g)
            own += scales.sum_factor[g] * double(sums.quanta[sums.at(uint32_t(cell), g, k) + c]);
          batch[k][c] = own * unit * kParts;
          most = std::max(most, batch[k][c]);
          all += own;
        }
        whole_[cell].channel[c] = float(all * unit);
      }
      if (!errors || !(most > 0) || !std::isfinite(most)) continue;
      whole_[cell].step = float(most / kSteps);
      for (size_t k = 0; k < kParts; ++k)
        for (size_t c = 0; c < 3; ++c)
          batches_[cell].steps[c][k] = uint16_t(kSteps * (batch[k][c] / most) + 0.5);
    }
  });
  if (!errors) return;
  double area = 0;
  for (uint32_t cell = 0; cell < cells.size(); ++cell) {
    const double own = cells.area(cell);
    area += own;
    for (size_t c = 0; c < 3; ++c) mean_radiosity_[c] += own * double(whole_[cell].channel[c]);
  }
  for (double& value : mean_radiosity_) value = area > 0 ? value / area : 0.0;
}

float Evaluation::brightness(uint32_t cell) const {
  const Whole& own = whole_[cell];
  return own.channel[0] + own.channel[1] + own.channel[2];
}

Evaluation::Carried Evaluation::carried(const ChainPool& chains, uint32_t number,
                                        float weight) const {
  Carried out{{0, 0, 0}, {weight, weight, weight}};
  const std::span<const Vertex> vertices = chains.vertices(number);
  for (size_t i = 0; i < vertices.size(); ++i) {
    const Vertex& vertex = vertices[i];
    const bool is_end = vertex.material & Vertex::kEnd;
    const Vec3f reflectance = reflectance_[vertex.material & ~Vertex::kEnd] *
                              (i < kSurely || is_end ? 1.0f : 1 / kGoesOn);
    const float dim = dim_[std::min<size_t>(vertex.light, dim_.size() - 1)];
    for (size_t c = 0; c < 3; ++c) {
      const float sent = out.through[c] * reflectance[int(c)];
      out.direct[c] += sent * vertex.direct[c] * dim;
      if (!is_end) out.through[c] = sent;
    }
  }
  for (float& own : out.through) own *= chains.weight(number);
  return out;
}

void Evaluation::read(const Looks& looks, size_t sample, double* irradiance, double* error) const {
  if (batches_.empty())
    add<false>(looks, sample, irradiance, error);
  else
    add<true>(looks, sample, irradiance, error);
}

template <bool kErrors>
void Evaluation::add(const Looks& looks, size_t sample, double* irradiance, double* error) const {
  const std::span<const uint32_t> targets = looks.targets(sample);
  const std::span<const float> weights = looks.weights(sample);
  const size_t n = targets.size();
  // By part of the rays and batch of the paths. Each part is a run of the Sobol' sequence, evenly
  // spread by itself; there are as many batches as parts.
  float sums[kParts][3][kParts] = {};
  double whole[3] = {};
  size_t rays[kParts];
  for (size_t part = 0; part < kParts; ++part) {
    const size_t first = n * part / kParts, last = n * (part + 1) / kParts;
    rays[part] = std::max<size_t>(1, last - first);
    float of_part[3] = {};
    for (size_t ray = first; ray < last; ++ray) {
      const uint32_t target = targets[ray];
      if (target == kDark) continue;
      const float weight = weights.empty() ? 1.0f : weights[ray];
      Carried own{{0, 0, 0}, {weight, weight, weight}};
      uint32_t cell = target;
      if (Looks::is_chain(target)) {
        const uint32_t number = Looks::chain_of(target);
        cell = looks.chains().end(number);
        own = carried(looks.chains(), number, weight);
        for (size_t c = 0; c < 3; ++c) {
          of_part[c] += own.direct[c];
          for (size_t k = 0; kErrors && k < kParts; ++k) sums[part][c][k] += own.direct[c];
        }
        if (cell == kDark) continue;
      }
      const Whole& radiosity = whole_[cell];
      for (size_t c = 0; c < 3; ++c) {
        of_part[c] += own.through[c] * radiosity.channel[c];
        if (!kErrors) continue;
        const float step = own.through[c] * radiosity.step;
        for (size_t k = 0; k < kParts; ++k)
          sums[part][c][k] += step * float(int(batches_[cell].steps[c][k]));
      }
    }
    for (size_t c = 0; c < 3; ++c) whole[c] += double(of_part[c]);
  }
  for (size_t c = 0; c < 3; ++c) irradiance[c] = whole[c] / double(n);
  if (!kErrors) return;
  for (size_t c = 0; c < 3; ++c) {
    double all = 0, mean[kParts][kParts];
    for (size_t part = 0; part < kParts; ++part)
      for (size_t k = 0; k < kParts; ++k) {
        mean[part][k] = double(sums[part][c][k]) / double(rays[part]);
        all += mean[part][k];
      }
    // Dark: as if one more ray had met a surface of mean brightness.
    error[c] = all > 0 ? std::sqrt(crossed_variance(mean)) : mean_radiosity_[c] / double(n);
  }
}

}  // namespace deltalux::gather
