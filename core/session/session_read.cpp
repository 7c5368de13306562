// SPDX-License-Identifier: Apache-2.0
// Reads results: irradiance and standard errors from integer sums.
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "base/assertion.h"
#include "session/read/cut_light.h"
#include "session/read/unreached.h"
#include "session/session.h"

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

/// Whether a gather ray of the sample meets a cell that a path reached, or a chain's vertex that a
/// light illuminates.
bool sees_light(const Gather& own, size_t sample) {
  const auto lit = [&](uint32_t cell) {
    if (cell == gather::kDark) return false;
    for (uint32_t g = 0; g < own.sums.groups; ++g)
      for (uint32_t k = 0; k < own.sums.batches; ++k)
        for (size_t c = 0; c < 3; ++c)
          if (own.sums.quanta[own.sums.at(cell, g, k) + c]) return true;
    return false;
  };
  const gather::ChainPool& chains = own.looks.chains();
  for (const uint32_t target : own.looks.targets(sample)) {
    if (!gather::Looks::is_chain(target)) {
      if (lit(target)) return true;
      continue;
    }
    const uint32_t number = gather::Looks::chain_of(target);
    if (lit(chains.end(number))) return true;
    for (const gather::Vertex& vertex : chains.vertices(number))
      if (vertex.direct != std::array<float, 3>{}) return true;
  }
  return false;
}

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

}  // namespace

size_t Session::unreached() const {
  check_readable();
  const State& s = *state_;
  const size_t n = s.samples.size(), slabs = s.discs.sums.size() / std::max<size_t>(1, 3 * n);
  size_t count = 0;
  for (size_t i = 0; i < n; ++i) {
    bool dark = s.is_present(i);
    for (size_t slab = 0; dark && slab < slabs; ++slab)
      for (size_t c = 0; c < 3; ++c) dark = dark && s.discs.sums[3 * (slab * n + i) + c] == 0;
    count += dark && !(s.gather && sees_light(*s.gather, i));
  }
  return count;
}

template <class Gathered, class Write>
void Session::read_samples(bool errors, const Gathered& gathered, const Write& write) const {
  const State& s = *state_;
  const size_t n = s.samples.size();
  check_readable();
  const std::span<const int64_t> direct = s.direct.light->sums();
  std::optional<gather::Evaluation> now = evaluation(errors);
  std::optional<UnreachedError> unreached;
  if (!now) unreached.emplace(s);
  if (now && errors) now->learn_spread(s.gather->looks);
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
        now ? gathered_block(*now, gathered, begin, end, errors)
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

template <class Gathered>
std::vector<gather::Estimate> Session::gathered_block(const gather::Evaluation& now,
                                                      const Gathered& gathered, size_t begin,
                                                      size_t end, bool errors) const {
  const State& s = *state_;
  std::vector<gather::Estimate> out(end - begin);
  for (size_t i = begin; i < end; ++i) {
    gather::Estimate& own = out[i - begin];
    own.point = s.direct.receivers[i].point, own.normal = s.direct.receivers[i].normal;
    own.object = s.samples.attached[i], own.rays = s.gather->looks.rays().count(i);
    if (s.is_present(i)) own.light = gathered(now, i);
  }
  if (errors) gather::pool_errors(out, s.gather->cells.metre());
  return out;
}

auto Session::all_gathered() const {
  return [&own = state_->gather](const gather::Evaluation& now, size_t i) {
    return now.read(own->looks, i);
  };
}

double Session::read(double* irradiance, double* standard_error) const {
  std::vector<double> lucky(state_->samples.size());  // variance, sum of all channels
  read_samples(true, all_gathered(), [&](size_t i, const gather::SampleLight& light) {
    std::copy_n(light.irradiance, 3, irradiance + 3 * i);
    std::copy_n(light.error, 3, standard_error + 3 * i);
    for (int c = 0; c < 3; ++c)
      lucky[i] += std::min(light.lucky[c], light.error[c] * light.error[c]);
  });
  return rebake_gain(irradiance, standard_error, lucky);
}

void Session::read_irradiance(double* irradiance) const {
  read_samples(false, all_gathered(), [&](size_t i, const gather::SampleLight& light) {
    std::copy_n(light.irradiance, 3, irradiance + 3 * i);
  });
}

void Session::read_direct(double* irradiance) const {
  const auto nothing = [](const gather::Evaluation&, size_t) { return gather::SampleLight{}; };
  read_samples(false, nothing, [&](size_t i, const gather::SampleLight& light) {
    std::copy_n(light.irradiance, 3, irradiance + 3 * i);
  });
}

void Session::read_packed(const std::array<double, 3>& weights, bool errors, float* values) const {
  if (state_->gather)
    state_->gather->glance.stale = true;  // otherwise the next glance() would mix in older values
  read_samples(errors, all_gathered(), [&](size_t i, const gather::SampleLight& light) {
    for (int c = 0; c < 3; ++c) values[4 * i + c] = float(light.irradiance[c]);
    if (errors)
      values[4 * i + 3] = float(weights[0] * light.error[0] + weights[1] * light.error[1] +
                                weights[2] * light.error[2]);
  });
}

void Session::glance(float* values) {
  constexpr size_t kTurns = 8;
  if (!state_->gather) return read_packed({}, false, values);
  gather::Looks& looks = state_->gather->looks;
  Glance& glance = state_->gather->glance;
  // stale if an exception interrupts the reading
  const bool all = std::exchange(glance.stale, true);
  glance.irradiance.resize(state_->samples.size());
  const auto gathered = [&](const gather::Evaluation& now, size_t i) {
    gather::SampleLight light;
    std::array<double, 3>& shown = glance.irradiance[i];
    // Samples take turns by their number, so that no whole patch of a surface lags behind its
    // surroundings.
    if (all || looks.changed(i) || i % kTurns == glance.turn)
      shown = std::to_array(now.read(looks, i).irradiance);
    std::copy(shown.begin(), shown.end(), light.irradiance);
    return light;
  };
  read_samples(false, gathered, [&](size_t i, const gather::SampleLight& light) {
    for (int c = 0; c < 3; ++c) values[4 * i + c] = float(light.irradiance[c]);
  });
  looks.forget_changes();
  glance.stale = false;
  glance.turn = (glance.turn + 1) % kTurns;
}

void Session::read_sums(int64_t* sums) const {
  check_whole();
  const State& s = *state_;
  const size_t n = 3 * s.samples.size();
  std::fill(sums, sums + n, 0);
  for (size_t slab = 0; slab * n < s.discs.sums.size(); ++slab)
    for (size_t i = 0; i < n; ++i)
      sums[3 * size_t(s.given[i / 3]) + i % 3] += s.discs.sums[slab * n + i];
}

std::vector<uint8_t> Session::visible(std::span<const Vec3f> from,
                                      std::span<const Vec3f> to) const {
  std::vector<uint8_t> out(from.size());
  const trace::RayCaster& caster = *state_->caster;
  state_->workers.for_blocks(out.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Vec3f way = to[i] - from[i];
      out[i] = !caster.occluded(from[i], way, 1.0f);
    }
  });
  return out;
}

EnergyAudit Session::audit() const {
  const State& s = *state_;
  int finest = s.sum_groups.front().finer;
  for (const SumGroup& group : s.sum_groups) finest = std::max(finest, group.finer);
  EnergyAudit audit;
  audit.quantum = s.scale.of(finest);
  const auto add = [finest](EnergyAudit::Quanta& sum, const uint32_t* power, int finer, int sign) {
    for (size_t c = 0; c < 3; ++c)
      sum[c] += sign * (EnergyAudit::Quanta::value_type(power[c]) << (finest - finer));
  };
  for (const trace::Light& light : s.lights) {
    if (!light.on) continue;
    const auto quanta = trace::birth_quanta(light, s.scale, s.birth_factor(light));
    const trace::Walk walk = s.walk();
    s.paths.held.each_of(light, [&](uint64_t i) {
      add(audit.emitted, walk.birth(light, i, quanta).power, light.finer, 1);
    });
  }
  const auto& bounces = s.paths.store.bounces();
  for (uint32_t b = 0; b < bounces.size(); ++b)
    for (uint32_t slot = 0; slot < bounces[b].size(); ++slot) {
      const segments::Segment& g = bounces[b].at(slot);
      if (g.length < 0) continue;
      const int finer = s.lights[s.light_of(g.path)].finer;
      if (g.primitive == scene::kNone) {
        add(audit.escaped, g.power, finer, 1);
        continue;
      }
      add(audit.absorbed, g.power, finer, 1);
      if (g.next != segments::kNoSlot)
        add(audit.absorbed, bounces[b + 1].at(g.next).power, finer, -1);
    }
  return audit;
}

}  // namespace deltalux::session
