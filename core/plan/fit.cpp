// SPDX-License-Identifier: Apache-2.0
// Solves the normal equations of a handful of unknowns by Gaussian elimination.
#include "plan/fit.h"

#include <algorithm>
#include <array>

namespace deltalux::plan {
namespace {

constexpr double kHold = 0.02;      // one search weighs as much as fifty priors
constexpr double kMinShare = 0.05;  // of the scaled prior: noise must not make a test free

using Matrix = std::array<std::array<double, kCounts + 1>, kCounts>;

/// Solves in place. The matrix is symmetric and positive definite; the last column is the
/// right-hand side, then the solution.
void solve(Matrix& m) {
  for (size_t i = 0; i < kCounts; ++i)
    for (size_t r = 0; r < kCounts; ++r) {
      if (r == i) continue;
      const double factor = m[r][i] / m[i][i];
      for (size_t c = i; c <= kCounts; ++c) m[r][c] -= factor * m[i][c];
    }
  for (size_t i = 0; i < kCounts; ++i) m[i][kCounts] /= m[i][i];
}

double dot(const Counts& a, const Counts& b) {
  double sum = 0;
  for (size_t i = 0; i < kCounts; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

Counts fit_constants(std::span<const Timed> searches, const Counts& prior) {
  std::vector<double> speeds;
  for (const Timed& s : searches) speeds.push_back(s.seconds / dot(s.counts, prior));
  std::ranges::nth_element(speeds, speeds.begin() + long(speeds.size() / 2));
  const double speed = speeds[speeds.size() / 2];
  // Solve for constants relative to the scaled prior.
  Matrix m{};
  for (size_t i = 0; i < kCounts; ++i) m[i][i] = m[i][kCounts] = kHold;
  for (const Timed& s : searches) {
    Counts share;
    for (size_t i = 0; i < kCounts; ++i) share[i] = s.counts[i] * speed * prior[i] / s.seconds;
    for (size_t r = 0; r < kCounts; ++r) {
      for (size_t c = 0; c < kCounts; ++c) m[r][c] += share[r] * share[c];
      m[r][kCounts] += share[r];
    }
  }
  solve(m);
  Counts found;
  for (size_t i = 0; i < kCounts; ++i)
    found[i] = speed * prior[i] * std::max(kMinShare, m[i][kCounts]);
  return found;
}

}  // namespace deltalux::plan
