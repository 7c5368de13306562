// SPDX-License-Identifier: Apache-2.0
// The state of direct light: computing it, and finding what an edit changes.
#include "direct/direct_light.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "direct/block.h"
#include "direct/view_code.h"

namespace deltalux::direct {
namespace {

using Shapes = std::vector<std::optional<LightShape>>;

Shapes make_shapes(const Present& present, uint64_t seed) {
  Shapes shapes(present.lights.size());
  for (uint32_t i = 0; i < shapes.size(); ++i)
    if (present.sampled[i]) shapes[i].emplace(present.lights[i], i, seed, present.caster.epsilon());
  return shapes;
}

/// Irradiance of the strongest channel in quanta.
int64_t weigh(const Present& present, const LightShape& shape, double quantum, size_t sample,
              const FixedView& view, std::span<const uint32_t> movables) {
  const Receiver& receiver = present.receivers[sample];
  const double share = visible_share(present.caster, shape, receiver, view, movables);
  if (!(share > 0)) return 0;
  const double open = shape.open(receiver) * shape.brightest() / quantum;
  return std::llround(std::min(open * share, kMostWeight));
}

}  // namespace

/// One (sample, light) pair that an update changes.
struct DirectLight::Record {
  uint32_t light, sample;
  int64_t weight;
  bool renewed;   // the fixed view too
  uint32_t view;  // then: its code, or an index into Found::partial
};
struct DirectLight::Found {
  std::vector<Record> records;
  std::vector<PartialView> partial;
};

DirectLight::DirectLight(size_t samples, uint32_t group_count, double irradiance_quantum,
                         uint64_t seed)
    : samples_(samples), group_count_(group_count), quantum_(irradiance_quantum), seed_(seed) {
  if (!(irradiance_quantum > 0) || !std::isfinite(irradiance_quantum))
    throw OptionError("direct light: found irradiance quantum " +
                      std::to_string(irradiance_quantum) + ", expected a positive number");
  sums_.assign(size_t(group_count) * samples * 3, 0);
}

void DirectLight::check(std::span<const trace::Light> lights,
                        std::span<const uint8_t> sampled) const {
  if (sampled.size() != lights.size())
    throw OptionError("direct light: found choices for " + std::to_string(sampled.size()) +
                      " lights, expected " + std::to_string(lights.size()));
  for (const trace::Light& light : lights)
    if (light.group >= group_count_)
      throw OptionError("direct light: found light group " + std::to_string(light.group) +
                        ", expected below " + std::to_string(group_count_));
}

void DirectLight::check(const Present& present) const {
  check(present.lights, present.sampled);
  if (present.receivers.size() != samples_)
    throw OptionError("direct light: found " + std::to_string(present.receivers.size()) +
                      " receivers, expected " + std::to_string(samples_));
}

std::vector<DirectLight::Column> DirectLight::make_columns(std::span<const trace::Light> lights,
                                                           std::span<const uint8_t> sampled,
                                                           size_t first) const {
  std::vector<Column> columns;
  for (size_t i = first; i < lights.size(); ++i) {
    const trace::Light& light = lights[i];
    Column& column = columns.emplace_back();
    column.group = light.group;
    const Vec3d power(light.kind == scene::LightKind::area ? light.radiance : light.intensity);
    const double brightest = std::max({power.x, power.y, power.z});
    if (brightest > 0) column.channel = power * (1 / brightest);
    if (!sampled[i]) continue;
    column.weight.assign(samples_, 0);
    column.view.assign(samples_, code_of(FixedView::Kind::empty));
  }
  return columns;
}

void DirectLight::add(const Column& column, size_t sample, int64_t weight, int sign) {
  int64_t* cell = &sums_[(size_t(column.group) * samples_ + sample) * 3];
  for (int c = 0; c < 3; ++c)
    cell[c] += sign * int64_t(std::llround(double(weight) * column.channel[c]));
}

FixedView DirectLight::view_of(const Column& column, size_t sample) const {
  const uint32_t code = column.view[sample];
  if (is_kind(code)) return {kind_of(code), 0, {}, 0};
  const PartialView& partial = partial_[code];
  return {FixedView::Kind::partial, partial.coarse, partial.fine, partial.share};
}

void DirectLight::compute(const Present& present, const Workers& workers, Progress& progress) {
  check(present);
  DirectLight fresh(samples_, group_count_, quantum_, seed_);
  fresh.columns_ = make_columns(present.lights, present.sampled, 0);
  const Shapes shapes = make_shapes(present, seed_);
  std::vector<std::vector<PartialView>> partial((samples_ + kBlock - 1) / kBlock);
  progress.begin("direct light", samples_);
  workers.for_blocks(samples_, kBlock, [&](size_t begin, size_t end) {
    const Block block(present.receivers, begin, end);
    std::vector<PartialView>& own = partial[begin / kBlock];
    for (size_t light = 0; light < shapes.size(); ++light) {
      if (!shapes[light]) continue;
      Blockers blockers(present.caster, present.lights[light], block);
      Column& column = fresh.columns_[light];
      for (size_t i = begin; i < end; ++i) {
        progress.check();
        const Receiver& receiver = present.receivers[i];
        const FixedView view = look(present.caster, *shapes[light], receiver);
        column.weight[i] = weigh(present, *shapes[light], quantum_, i, view, blockers.of(receiver));
        column.view[i] = code_of(view.kind, own.size());
        if (view.kind == FixedView::Kind::partial)
          own.push_back({view.coarse, view.fine, view.share});
        fresh.add(column, i, column.weight[i], 1);
      }
    }
    progress.advance(end - begin);
  });
  for (size_t block = 0; block < partial.size(); ++block) {
    const uint32_t base = uint32_t(fresh.partial_.size());
    for (Column& column : fresh.columns_)
      for (size_t i = block * kBlock; i < std::min(column.view.size(), (block + 1) * kBlock); ++i)
        if (!is_kind(column.view[i])) column.view[i] += base;
    fresh.partial_.insert(fresh.partial_.end(), partial[block].begin(), partial[block].end());
    partial[block] = {};
  }
  *this = std::move(fresh);
}

void DirectLight::update(const Present& present, const Change& change, const Workers& workers,
                         Progress& progress) {
  check(present);
  std::vector<Found> found((samples_ + kBlock - 1) / kBlock);
  find_changes(present, change, workers, progress, found);
  commit(found, make_columns(present.lights, present.sampled, columns_.size()));
}

void DirectLight::find_changes(const Present& present, const Change& change, const Workers& workers,
                               Progress& progress, std::vector<Found>& found) const {
  const Shapes shapes = make_shapes(present, seed_);
  std::vector<uint8_t> light_changed(shapes.size(), 0), sample_changed(samples_, 0);
  for (uint32_t i : change.lights) light_changed[i] = 1;
  for (uint32_t i : change.samples) sample_changed[i] = 1;
  for (size_t i = columns_.size(); i < shapes.size(); ++i) light_changed[i] = 1;
  std::vector<ShadowVolume> shadows;  // of every changed box, light by light
  for (const trace::Light& light : present.lights)
    for (const Box& box : change.boxes) shadows.emplace_back(light, box, slack(present.caster));

  constexpr uint32_t kShadowed = 1, kRenewed = 2;
  progress.begin("direct light", samples_);
  workers.for_blocks(samples_, kBlock, [&](size_t begin, size_t end) {
    const Block block(present.receivers, begin, end);
    Found& own = found[begin / kBlock];
    bool any_sample = false;
    for (size_t i = begin; i < end; ++i) any_sample |= sample_changed[i] != 0;
    for (uint32_t light = 0; light < shapes.size(); ++light) {
      if (!shapes[light]) continue;
      progress.check();
      uint32_t marks[kBlock] = {};
      bool any = any_sample || light_changed[light];
      for (size_t i = 0; any && i < block.count; ++i)
        if (light_changed[light] || sample_changed[begin + i]) marks[i] = kRenewed;
      for (size_t k = 0; !light_changed[light] && k < change.boxes.size(); ++k) {
        const ShadowVolume& shadow = shadows[light * change.boxes.size() + k];
        if (shadow.misses(block.bounds)) continue;
        shadow.mark(block.x, block.y, block.z, block.count, marks);
        any = true;
      }
      if (!any) continue;
      std::optional<Blockers> blockers;
      for (size_t i = begin; i < end; ++i) {
        const bool renewed = marks[i - begin] & kRenewed;
        if (!renewed && !(marks[i - begin] & kShadowed)) continue;
        progress.check();
        const FixedView view = renewed ? look(present.caster, *shapes[light], present.receivers[i])
                                       : view_of(columns_[light], i);
        if (!renewed && view.kind != FixedView::Kind::open && view.kind != FixedView::Kind::partial)
          continue;
        if (!blockers) blockers.emplace(present.caster, present.lights[light], block);
        const int64_t weight =
            weigh(present, *shapes[light], quantum_, i, view, blockers->of(present.receivers[i]));
        if (!renewed && weight == columns_[light].weight[i]) continue;
        own.records.push_back(
            {light, uint32_t(i), weight, renewed, code_of(view.kind, own.partial.size())});
        if (renewed && view.kind == FixedView::Kind::partial)
          own.partial.push_back({view.coarse, view.fine, view.share});
      }
    }
    progress.advance(end - begin);
  });
}

void DirectLight::commit(const std::vector<Found>& found, std::vector<Column> added) {
  // Nothing throws once the room is there.
  size_t fresh = 0, renewed = 0;
  for (const Found& block : found) {
    fresh += block.partial.size();
    for (const Record& record : block.records) renewed += record.renewed;
  }
  columns_.reserve(columns_.size() + added.size());
  partial_.reserve(partial_.size() + fresh);
  unused_.reserve(unused_.size() + renewed);
  for (Column& column : added) columns_.push_back(std::move(column));
  for (const Found& block : found)
    for (const Record& record : block.records) {
      Column& column = columns_[record.light];
      add(column, record.sample, column.weight[record.sample], -1);
      add(column, record.sample, record.weight, 1);
      column.weight[record.sample] = record.weight;
      if (!record.renewed) continue;
      uint32_t& view = column.view[record.sample];
      if (!is_kind(view)) unused_.push_back(view);
      view = record.view;
      if (is_kind(view)) continue;
      const PartialView& still = block.partial[record.view];
      if (unused_.empty()) {
        view = uint32_t(partial_.size());
        partial_.push_back(still);
      } else {
        view = unused_.back();
        unused_.pop_back();
        partial_[view] = still;
      }
    }
}

}  // namespace deltalux::direct
