// SPDX-License-Identifier: Apache-2.0
// Adds up sums, direct light and gathered light, sample by sample, in a fixed order.
#include "session/read/read_light.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "base/assertion.h"
#include "gather/hits/pool_errors.h"
#include "session/read/cut_light.h"
#include "session/read/unreached.h"

namespace deltalux::session {
namespace {

/// double(x) by operations that AVX2 has: the halves of `x` become mantissas, and only the last
/// addition rounds. Scalar conversions made reading 1.4 times as slow.
double to_double(int64_t x) {
  const double low = std::bit_cast<double>((uint64_t(x) & 0xffffffffu) | 0x4330000000000000u);
  const double high =
      std::bit_cast<double>((uint64_t(x) >> 32 ^ 0x80000000u) | 0x4530000000000000u);
  return (high - (0x1p84 + 0x1p63 + 0x1p52)) + low;
}

/// Energy and direct light of a block of samples, three channels each, and the variance of the
/// energy, from the spread of batches.
class BlockSums {
 public:
  static constexpr size_t kSamples = 512;

  /// Adds the energy of one light group: kBatches rows of `values` sums, `stride` apart.
  void add_energy(const int64_t* row, size_t stride, size_t values, double factor) {
    std::fill_n(total_, values, int64_t(0));
    for (uint32_t k = 0; k < kBatches; ++k)
      for (size_t j = 0; j < values; ++j) total_[j] += row[k * stride + j];
    for (size_t j = 0; j < values; ++j) mean_[j] = to_double(total_[j]) / kBatches;
    std::fill_n(spread_, values, 0.0);
    for (uint32_t k = 0; k < kBatches; ++k)
      for (size_t j = 0; j < values; ++j) {
        const double off = to_double(row[k * stride + j]) - mean_[j];
        spread_[j] += off * off;
      }
    const double share = factor * factor * kBatches / (kBatches - 1.0);
    for (size_t j = 0; j < values; ++j) {
      energy[j] += factor * to_double(total_[j]);
      variance[j] += share * spread_[j];
    }
  }
  /// For samples that no path of the group added last has reached, adds the variance that
  /// UnreachedError estimates.
  void add_unreached(const UnreachedError& unreached, uint32_t group, const float* area,
                     size_t samples) {
    for (size_t i = 0; i < samples; ++i) {
      if (total_[3 * i] && total_[3 * i + 1] && total_[3 * i + 2]) continue;
      const Vec3d error = unreached.at(group, double(area[i]));
      for (size_t c = 0; c < 3; ++c)
        if (!total_[3 * i + c]) variance[3 * i + c] += error[int(c)] * error[int(c)];
    }
  }
  /// Adds one light group's direct light, `unit` per quantum.
  void add_direct(const int64_t* row, size_t values, double unit) {
    for (size_t j = 0; j < values; ++j) direct[j] += unit * to_double(row[j]);
  }

  double energy[3 * kSamples] = {}, variance[3 * kSamples] = {}, direct[3 * kSamples] = {};

 private:
  int64_t total_[3 * kSamples];
  double mean_[3 * kSamples], spread_[3 * kSamples];
};

/// The RMS of relative errors over that without variance of lucky rays; both are samples x 3. Of
/// dark samples, errors are relative to a tenth of the mean.
double rebake_gain(const double* irradiance, const double* error, std::span<const double> lucky) {
  const size_t n = lucky.size();
  const double mean =
      std::accumulate(irradiance, irradiance + 3 * n, 0.0) / double(std::max<size_t>(1, n));
  double now = 0, then = 0;
  for (size_t i = 0; i < n; ++i) {
    double light = 0, variance = 0;
    for (size_t k = 3 * i; k < 3 * i + 3; ++k)
      light += irradiance[k], variance += error[k] * error[k];
    const double scale = std::max(light, 0.1 * mean);
    if (!(scale > 0)) continue;
    now += variance / (scale * scale), then += (variance - lucky[i]) / (scale * scale);
  }
  return now > 0 ? std::sqrt(now / std::max(then, 1e-4 * now)) : 1.0;
}

/// Reads the gathered light of samples [begin, end), with pooled errors if `errors`.
template <class Gathered>
std::vector<gather::Estimate> gathered_block(const State& s, const gather::Evaluation& now,
                                             const Gathered& gathered, size_t begin, size_t end,
                                             bool errors) {
  std::vector<gather::Estimate> out(end - begin);
  for (size_t i = begin; i < end; ++i) {
    gather::Estimate& own = out[i - begin];
    own.point = s.direct.receivers[i].point, own.normal = s.direct.receivers[i].normal;
    own.object = s.samples.attached[i], own.rays = s.rays.hits.rays().count(i);
    if (s.is_present(i)) own.light = gathered(now, i);
  }
  if (errors) gather::pool_errors(out, s.cells.division.metre());
  return out;
}

/// For each sample, in parallel, calls write(its index as given by the user, SampleLight). In
/// sessions with a final gather, the part of the light that rays bring is gathered(evaluation,
/// sample), for each present sample.
template <class Gathered, class Write>
void read_samples(State& s, bool errors, const Gathered& gathered, const Write& write) {
  const size_t n = s.samples.size();
  check_readable(s);
  const std::span<const int64_t> direct = s.direct.light->sums();
  std::optional<gather::Evaluation> now;
  if (s.gathers()) now = s.rays.evaluation(errors);
  std::optional<UnreachedError> unreached;
  if (!now) unreached.emplace(s);
  if (now && errors) now->learn_spread(s.rays.hits);
  const bool discs = s.counts_in_discs();
  const Vec3d cut = errors ? cut_share(s) : Vec3d{};
  s.workers.for_blocks(n, BlockSums::kSamples, [&](size_t begin, size_t end) {
    BlockSums block;
    const size_t values = 3 * (end - begin);
    for (uint32_t g = 0; discs && g < s.sum_groups.size(); ++g) {
      block.add_energy(&s.discs.sums[3 * (size_t(g) * kBatches * n + begin)], 3 * n, values,
                       s.sum_unit(g));
      if (unreached) block.add_unreached(*unreached, g, &s.discs.area[begin], end - begin);
    }
    double of_direct[3 * BlockSums::kSamples] = {};  // variance
    for (uint32_t part = 0; part < s.direct.light->parts().size(); ++part) {
      const auto& [group, quantum] = s.direct.light->parts()[part];
      const double factor = s.group_factor[group] * quantum;
      block.add_direct(&direct[3 * (size_t(part) * n + begin)], values, factor);
      if (errors) s.direct.light->add_variance(part, begin, end, factor * factor, of_direct);
    }
    const std::vector<gather::Estimate> around =
        now ? gathered_block(s, *now, gathered, begin, end, errors)
            : std::vector<gather::Estimate>(end - begin);
    for (size_t i = begin; i < end; ++i) {
      const double area = discs ? double(s.discs.area[i]) : 0.0;
      const double per_area = area > 0 ? 1 / area : 0.0;
      gather::SampleLight light;
      for (size_t c = 0; s.is_present(i) && c < 3; ++c) {
        const size_t j = 3 * (i - begin) + c;
        const gather::SampleLight& own = around[i - begin].light;
        const double by_paths = block.energy[j] * per_area + own.irradiance[c];
        light.irradiance[c] = by_paths + block.direct[j];
        light.error[c] =
            std::sqrt(block.variance[j] * per_area * per_area + own.error[c] * own.error[c] +
                      by_paths * by_paths * cut[int(c)] * cut[int(c)] + of_direct[j]);
        light.lucky[c] = own.lucky[c];
        DELTALUX_ASSERT(std::isfinite(light.irradiance[c]) && std::isfinite(light.error[c]));
      }
      write(size_t(s.given[i]), light);
    }
  });
}

/// A callback for read_samples() that reads the gathered light of every sample.
auto all_gathered(const State& s) {
  return
      [&hits = s.rays.hits](const gather::Evaluation& now, size_t i) { return now.read(hits, i); };
}

}  // namespace

double read(State& s, double* irradiance, double* standard_error) {
  std::vector<double> lucky(s.samples.size());  // variance, sum of all channels
  read_samples(s, true, all_gathered(s), [&](size_t i, const gather::SampleLight& light) {
    std::copy_n(light.irradiance, 3, irradiance + 3 * i);
    std::copy_n(light.error, 3, standard_error + 3 * i);
    for (int c = 0; c < 3; ++c)
      lucky[i] += std::min(light.lucky[c], light.error[c] * light.error[c]);
  });
  return s.is_as_loaded() ? 1.0 : rebake_gain(irradiance, standard_error, lucky);
}

void read_irradiance(State& s, double* irradiance) {
  read_samples(s, false, all_gathered(s), [&](size_t i, const gather::SampleLight& light) {
    std::copy_n(light.irradiance, 3, irradiance + 3 * i);
  });
}

void read_direct(State& s, double* irradiance) {
  const auto nothing = [](const gather::Evaluation&, size_t) { return gather::SampleLight{}; };
  read_samples(s, false, nothing, [&](size_t i, const gather::SampleLight& light) {
    std::copy_n(light.irradiance, 3, irradiance + 3 * i);
  });
}

void read_packed(State& s, const std::array<double, 3>& weights, bool errors, float* values) {
  if (s.gathers())
    s.rays.glance.stale = true;  // otherwise the next glance() would mix in older values
  read_samples(s, errors, all_gathered(s), [&](size_t i, const gather::SampleLight& light) {
    for (int c = 0; c < 3; ++c) values[4 * i + c] = float(light.irradiance[c]);
    if (errors)
      values[4 * i + 3] = float(weights[0] * light.error[0] + weights[1] * light.error[1] +
                                weights[2] * light.error[2]);
  });
}

void glance(State& s, float* values) {
  constexpr size_t kTurns = 8;
  if (!s.gathers()) return read_packed(s, {}, false, values);
  gather::GatherHits& hits = s.rays.hits;
  Glance& glance = s.rays.glance;
  // stale if an exception interrupts the reading
  const bool all = std::exchange(glance.stale, true);
  glance.irradiance.resize(s.samples.size());
  const auto gathered = [&](const gather::Evaluation& now, size_t i) {
    gather::SampleLight light;
    std::array<double, 3>& shown = glance.irradiance[i];
    // Samples take turns by their number, so that no whole patch of a surface lags behind its
    // surroundings.
    if (all || hits.changed(i) || i % kTurns == glance.turn)
      shown = std::to_array(now.read(hits, i).irradiance);
    std::copy(shown.begin(), shown.end(), light.irradiance);
    return light;
  };
  read_samples(s, false, gathered, [&](size_t i, const gather::SampleLight& light) {
    for (int c = 0; c < 3; ++c) values[4 * i + c] = float(light.irradiance[c]);
  });
  hits.forget_changes();
  glance.stale = false;
  glance.turn = (glance.turn + 1) % kTurns;
}

void read_sums(const State& s, int64_t* sums) {
  check_whole(s);
  const size_t n = 3 * s.samples.size();
  std::fill(sums, sums + n, 0);
  for (size_t slab = 0; slab * n < s.discs.sums.size(); ++slab)
    for (size_t i = 0; i < n; ++i)
      sums[3 * size_t(s.given[i / 3]) + i % 3] += s.discs.sums[slab * n + i];
}

}  // namespace deltalux::session
