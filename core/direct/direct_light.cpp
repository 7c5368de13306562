// SPDX-License-Identifier: Apache-2.0
// Computes direct light, and finds what an edit changes of it.
#include "direct/direct_light.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/assertion.h"
#include "base/error.h"
#include "base/stopwatch.h"
#include "direct/block.h"
#include "direct/view_code.h"

namespace deltalux::direct {
namespace {

/// Shapes of the given lights, by light; the others are empty.
Shapes make_shapes(const Context& context, std::span<const uint32_t> lights, uint64_t seed,
                   double reference) {
  Shapes shapes(context.lights.size());
  for (uint32_t i : lights) shapes[i] = shape_of(context.lights[i], i, seed, reference);
  return shapes;
}

}  // namespace

/// One (sample, light) pair that an update changes.
struct DirectLight::Record {
  uint32_t light, sample;
  Weight weight;
  bool renewed;   // whether the fixed view has changed, too
  uint32_t view;  // if so: its code, or an index into BlockChanges::partial
};
/// The changes found in one block of receivers.
struct DirectLight::BlockChanges {
  std::vector<Record> records;
  std::vector<StoredView> partial;
};

/// The recent changes that each light does not take into account yet.
class DirectLight::Outstanding {
 public:
  explicit Outstanding(const DirectLight& direct)
      : direct_(direct),
        light_(direct.columns_.size()),
        sample_(direct.samples_),
        block_(block_count(direct.samples_)) {
    uint64_t number = direct.past_;  // of changes up to the current one
    for (const DirectChange& change : direct.recent_) {
      ++number;
      first_box_.push_back(boxes_.size());
      boxes_.insert(boxes_.end(), change.boxes.begin(), change.boxes.end());
      for (uint32_t i : change.lights) light_[i] = number;
      for (uint32_t i : change.samples) sample_[i] = block_[i / kBlock] = number;
    }
  }
  bool light_changed(uint32_t light) const { return light_[light] > taken(light); }
  /// Whether any sample of the block that begins with `sample` changed.
  bool block_changed(uint32_t light, size_t sample) const {
    return block_[sample / kBlock] > taken(light);
  }
  bool sample_changed(uint32_t light, size_t sample) const {
    return sample_[sample] > taken(light);
  }
  std::span<const Box> boxes(uint32_t light) const {
    return std::span(boxes_).subspan(first_box_[taken(light) - direct_.past_]);
  }

 private:
  uint64_t taken(uint32_t light) const { return direct_.columns_[light].taken; }

  const DirectLight& direct_;
  // number of the last change that names the light, sample or block
  std::vector<uint64_t> light_, sample_, block_;
  std::vector<Box> boxes_;
  std::vector<size_t> first_box_;  // by change
};

DirectLight::DirectLight(size_t samples, const Scales& scales, uint64_t seed)
    : samples_(samples), scales_(scales), seed_(seed) {
  if (!(scales.quantum > 0) || !std::isfinite(scales.quantum))
    throw OptionError("direct light: found irradiance quantum " + std::to_string(scales.quantum) +
                      ", expected a positive number");
}

void DirectLight::check(std::span<const trace::Light> lights, std::span<const uint8_t> sampled) {
  if (sampled.size() != lights.size())
    throw OptionError("direct light: found choices for " + std::to_string(sampled.size()) +
                      " lights, expected " + std::to_string(lights.size()));
}

void DirectLight::check(const Context& context) const {
  check(context.lights, context.sampled);
  if (context.receivers.size() != samples_)
    throw OptionError("direct light: found " + std::to_string(context.receivers.size()) +
                      " receivers, expected " + std::to_string(samples_));
}

void DirectLight::append_columns(std::span<const trace::Light> lights,
                                 std::span<const uint8_t> sampled) {
  for (size_t i = columns_.size(); i < lights.size(); ++i) {
    const trace::Light& light = lights[i];
    Column& column = columns_.emplace_back();
    const Vec3d power(light.strength);
    const double brightest = std::max({power.x, power.y, power.z});
    if (brightest > 0) column.channel = power * (1 / brightest);
    if (!sampled[i]) continue;
    column.quantum = quantum_of(light, scales_);
    const Part part{light.group, column.quantum};
    const auto found = std::find(parts_.begin(), parts_.end(), part);
    column.part = uint32_t(found - parts_.begin());
    if (found == parts_.end()) parts_.push_back(part);
    column.weight.assign(samples_, 0);
    column.view.assign(samples_, code_of(FixedView::Kind::empty));
    if (light.area > 0) column.error.assign(samples_, 0);
  }
  sums_.resize(parts_.size() * samples_ * 3, 0);
}

void DirectLight::shrink(size_t columns, size_t parts) {
  columns_.resize(columns);
  parts_.resize(parts);
  sums_.resize(std::min(sums_.size(), parts * samples_ * 3));
}

void DirectLight::add(const Column& column, size_t sample, int64_t weight, int sign) {
  int64_t* cell = &sums_[(size_t(column.part) * samples_ + sample) * 3];
  for (int c = 0; c < 3; ++c)
    cell[c] += sign * int64_t(std::llround(double(weight) * column.channel[c]));
  DELTALUX_ASSERT(std::min({cell[0], cell[1], cell[2]}) >= 0);
}

void DirectLight::set(Column& column, size_t sample, Weight weight) {
  add(column, sample, column.weight[sample], -1);
  add(column, sample, weight.light, 1);
  column.weight[sample] = weight.light;
  if (!column.error.empty()) column.error[sample] = weight.error;
}

DirectLight::Weight DirectLight::weight_of(const Column& column, size_t sample) const {
  return {column.weight[sample], column.error.empty() ? uint16_t(0) : column.error[sample]};
}

FixedView DirectLight::view_of(const Column& column, size_t sample) const {
  const uint32_t code = column.view[sample];
  if (is_kind(code)) return {kind_of(code), 0, {}, 0};
  return partial_[code].view();
}

DirectLight::Weight DirectLight::weigh(const Context& context, const LightShape& shape,
                                       const Column& column, size_t sample, double open,
                                       const FixedView& view, std::span<const uint32_t> movables) {
  const Seen seen =
      visible_share(context.caster, shape, context.receivers[sample], open, view, movables);
  DELTALUX_ASSERT(seen.share >= 0 && seen.share <= 1 + 1e-6 && open >= 0);
  const double quanta = open * shape.brightest() / column.quantum;
  return {std::llround(std::min(quanta * seen.share, kMaxWeight)),
          error_code(float(std::min(quanta * double(seen.error), kMaxWeight)))};
}

void DirectLight::add_variance(uint32_t part, size_t begin, size_t end, double factor,
                               double* out) const {
  for (const Column& column : columns_) {
    if (column.part != part || column.error.empty()) continue;
    for (size_t i = begin; i < end; ++i) {
      if (!column.error[i]) continue;
      const double error = double(error_of(column.error[i]));
      for (int c = 0; c < 3; ++c) {
        const double own = error * column.channel[c];
        out[3 * (i - begin) + size_t(c)] += factor * own * own;
      }
    }
  }
}

void DirectLight::compute(const Context& context, const Workers& workers, Progress& progress) {
  check(context);
  DirectLight fresh(samples_, scales_, seed_);
  fresh.append_columns(context.lights, context.sampled);
  std::vector<uint32_t> chosen;
  for (uint32_t i = 0; i < context.lights.size(); ++i)
    if (context.sampled[i]) chosen.push_back(i);
  const Shapes shapes = make_shapes(context, chosen, seed_, scales_.reference);
  std::vector<std::vector<StoredView>> partial(block_count(samples_));
  progress.begin("direct light", samples_);
  workers.for_blocks(samples_, kBlock, [&](size_t begin, size_t end) {
    const ReceiverBlock block(context.receivers, begin, end);
    std::vector<StoredView>& own = partial[begin / kBlock];
    for (size_t light = 0; light < shapes.size(); ++light) {
      if (!shapes[light]) continue;
      Blockers blockers(context.caster, context.lights[light], block);
      Column& column = fresh.columns_[light];
      for (size_t i = begin; i < end; ++i) {
        progress.check();
        const Receiver& receiver = context.receivers[i];
        const double open = shapes[light]->open(receiver);
        if (!(open > 0)) continue;
        const FixedView view = fixed_view(context.caster, *shapes[light], receiver, open);
        fresh.set(column, i,
                  weigh(context, *shapes[light], column, i, open, view, blockers.of(receiver)));
        column.view[i] = code_of(view.kind, own.size());
        if (view.kind == FixedView::Kind::partial) own.emplace_back(view);
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

void DirectLight::update(const Context& context, const DirectChange& change, const Workers& workers,
                         Progress& progress, double budget_ms) {
  check(context);
  const Stopwatch watch;
  const size_t old_columns = columns_.size(), old_parts = parts_.size();
  const uint64_t before = past_ + recent_.size();
  DirectChange latest = change;
  std::vector<BlockChanges> found(block_count(samples_));
  std::vector<uint32_t> lights;
  size_t done = 0;
  try {
    append_columns(context.lights, context.sampled);
    for (size_t i = old_columns; i < columns_.size(); ++i) {
      columns_[i].taken = before;
      latest.lights.push_back(uint32_t(i));
    }
    if (!latest.boxes.empty() || !latest.lights.empty() || !latest.samples.empty())
      recent_.push_back(std::move(latest));
    lights = waiting();
    const Outstanding outstanding(*this);
    const size_t step = budget_ms > 0 ? 1 : std::max<size_t>(1, lights.size());
    progress.begin("direct light", samples_ * ((lights.size() + step - 1) / step));
    const auto in_time = [&] { return budget_ms <= 0 || watch.milliseconds() < budget_ms; };
    for (; done < lights.size() && (done == 0 || in_time()); done += step)
      find_changes(context, outstanding, std::span(lights).subspan(done, step), workers, progress,
                   found);
    make_room(found);
  } catch (...) {
    while (past_ + recent_.size() > before) recent_.pop_back();
    shrink(old_columns, old_parts);
    throw;
  }
  // Nothing throws below this line.
  commit(found);
  for (uint32_t light : std::span(lights).first(std::min(done, lights.size())))
    columns_[light].taken = past_ + recent_.size();
  if (done < lights.size()) turn_ = lights[done];
  forget();
}

std::vector<uint32_t> DirectLight::waiting() const {
  std::vector<uint32_t> lights;
  const uint32_t count = uint32_t(columns_.size());
  for (uint32_t k = 0; k < count; ++k)
    if (const uint32_t light = (turn_ + k) % count; !current(columns_[light]))
      lights.push_back(light);
  return lights;
}

void DirectLight::forget() {
  uint64_t least = past_ + recent_.size();
  for (const Column& column : columns_)
    if (!column.weight.empty()) least = std::min(least, column.taken);
  for (; past_ < least; ++past_) recent_.pop_front();
}

double DirectLight::current_share() const {
  const auto sampled = std::count_if(columns_.begin(), columns_.end(),
                                     [](const Column& column) { return !column.weight.empty(); });
  const size_t behind = waiting().size();
  return behind ? 1 - double(behind) / double(sampled) : 1.0;
}

void DirectLight::find_changes(const Context& context, const Outstanding& outstanding,
                               std::span<const uint32_t> lights, const Workers& workers,
                               Progress& progress, std::vector<BlockChanges>& found) const {
  const Shapes shapes = make_shapes(context, lights, seed_, scales_.reference);
  std::vector<std::vector<trace::ShadowVolume>> shadows(
      lights.size());  // of the changed objects' boxes
  for (size_t l = 0; l < lights.size(); ++l)
    for (const Box& box : outstanding.boxes(lights[l]))
      shadows[l].emplace_back(context.lights[lights[l]], box, trace::shadow_slack(context.caster));

  constexpr uint32_t kShadowed = 1, kRenewed = 2;
  workers.for_blocks(samples_, kBlock, [&](size_t begin, size_t end) {
    const ReceiverBlock block(context.receivers, begin, end);
    BlockChanges& own = found[begin / kBlock];
    for (size_t l = 0; l < lights.size(); ++l) {
      progress.check();
      const uint32_t light = lights[l];
      uint32_t marks[kBlock] = {};
      const bool all = outstanding.light_changed(light);
      bool any = all || outstanding.block_changed(light, begin);  // skip the samples of most blocks
      for (size_t i = 0; any && i < block.count; ++i)
        if (all || outstanding.sample_changed(light, begin + i)) marks[i] = kRenewed;
      for (const trace::ShadowVolume& shadow : shadows[l]) {
        if (all || shadow.misses(block.bounds)) continue;
        shadow.mark(block.x, block.y, block.z, block.count, marks);
        any = true;
      }
      if (!any) continue;
      std::optional<Blockers> blockers;
      for (size_t i = begin; i < end; ++i) {
        const bool renewed = marks[i - begin] & kRenewed;
        if (!renewed && !(marks[i - begin] & kShadowed)) continue;
        progress.check();
        FixedView view = view_of(columns_[light], i);
        if (!renewed && view.kind != FixedView::Kind::open && view.kind != FixedView::Kind::partial)
          continue;
        const double open = shapes[light]->open(context.receivers[i]);
        if (renewed) view = fixed_view(context.caster, *shapes[light], context.receivers[i], open);
        if (!blockers) blockers.emplace(context.caster, context.lights[light], block);
        const Weight weight = weigh(context, *shapes[light], columns_[light], i, open, view,
                                    blockers->of(context.receivers[i]));
        if (!renewed && weight == weight_of(columns_[light], i)) continue;
        own.records.push_back(
            {light, uint32_t(i), weight, renewed, code_of(view.kind, own.partial.size())});
        if (renewed && view.kind == FixedView::Kind::partial) own.partial.emplace_back(view);
      }
    }
    progress.advance(end - begin);
  });
}

void DirectLight::make_room(const std::vector<BlockChanges>& found) {
  size_t fresh = 0, renewed = 0;
  for (const BlockChanges& block : found) {
    fresh += block.partial.size();
    for (const Record& record : block.records) renewed += record.renewed;
  }
  partial_.reserve(partial_.size() + fresh);
  unused_.reserve(unused_.size() + renewed);
}

void DirectLight::commit(const std::vector<BlockChanges>& found) {
  for (const BlockChanges& block : found)
    for (const Record& record : block.records) {
      Column& column = columns_[record.light];
      set(column, record.sample, record.weight);
      if (!record.renewed) continue;
      uint32_t& view = column.view[record.sample];
      if (!is_kind(view)) unused_.push_back(view);
      view = record.view;
      if (is_kind(view)) continue;
      const StoredView& still = block.partial[record.view];
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
