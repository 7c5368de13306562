// SPDX-License-Identifier: Apache-2.0
// One look-up a ray.
#include "gather/evaluate.h"

#include <cmath>

#include "base/error.h"

namespace deltalux::gather {
namespace {

constexpr size_t kRow = 4;  // three channels and padding
constexpr float kNothing[9 * kRow] = {};

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
}

void Evaluation::add(const ChainPool& chains, uint32_t target, float* sums) const {
  if (target == kDark) return;
  if (!Looks::is_chain(target)) {
    const float* row = &radiosity_[size_t(target) * (kParts + 1) * kRow];
    for (size_t i = 0; i < (kParts + 1) * kRow; ++i) sums[i] += row[i];
    return;
  }
  const uint32_t chain = Looks::chain_of(target), end = chains.end(chain);
  float direct[3] = {}, through[3] = {1, 1, 1};
  uint32_t number = 0;
  for (const Vertex& vertex : chains.vertices(chain)) {
    const Vec3f reflectance = scene_.materials[vertex.material].reflectance;
    const float dim = float(scales_.dim_factor[lights_[vertex.light].group]);
    const float chance = number++ >= kSurely ? 1 / kGoesOn : 1.0f;
    for (size_t c = 0; c < 3; ++c) {
      through[c] *= reflectance[int(c)] * chance;
      direct[c] += through[c] * vertex.direct[c] * dim;
    }
  }
  const float* row = end == kDark ? kNothing : &radiosity_[size_t(end) * (kParts + 1) * kRow];
  for (size_t part = 0; part <= kParts; ++part)
    for (size_t c = 0; c < 3; ++c) sums[part * kRow + c] += direct[c] + through[c] * row[part * kRow + c];
}

void Evaluation::read(const Looks& looks, size_t sample, double* irradiance,
                      double* error) const {
  float batch[(kParts + 1) * kRow] = {};
  double share[kParts][3] = {};
  const std::span<const uint32_t> targets = looks.targets(sample);
  const size_t n = targets.size();
  // Each part is a run of the Sobol' sequence, evenly spread by itself.
  for (size_t part = 0; part < kParts; ++part) {
    float before[3] = {batch[kParts * kRow], batch[kParts * kRow + 1], batch[kParts * kRow + 2]};
    const size_t first = n * part / kParts, last = n * (part + 1) / kParts;
    for (size_t ray = first; ray < last; ++ray) add(looks.chains(), targets[ray], batch);
    const double rays = double(last - first);
    for (size_t c = 0; c < 3; ++c)
      share[part][c] = rays > 0 ? double(batch[kParts * kRow + c] - before[c]) / rays : 0.0;
  }
  for (size_t c = 0; c < 3; ++c) {
    irradiance[c] = double(batch[kParts * kRow + c]) / double(n);
    double paths = 0, rays = 0;
    for (size_t k = 0; k < kParts; ++k) {
      const double off = double(batch[k * kRow + c]) / double(n) - irradiance[c];
      paths += off * off;
      rays += (share[k][c] - irradiance[c]) * (share[k][c] - irradiance[c]);
    }
    error[c] = std::sqrt((paths + rays) / (kParts * (kParts - 1.0)));
  }
}

}  // namespace deltalux::gather
