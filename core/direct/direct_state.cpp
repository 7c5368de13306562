// SPDX-License-Identifier: Apache-2.0
// Memory and snapshots of direct light.
#include <algorithm>
#include <bit>

#include "base/error.h"
#include "direct/direct_light.h"
#include "direct/view_code.h"

namespace deltalux::direct {
namespace {

// Measured in the office, the exhibition hall and the atrium: the share of (sample, light) pairs
// that face each other (0.60 to 0.66), the share of pairs with partial visibility of the light due
// to static geometry (0.03, 0.14, 0.21), and the cost of a triangle's closed form, in shadow rays.
constexpr double kFacingShare = 0.6, kPartialShare = 0.15, kRaysPerTriangle = 0.2;
constexpr size_t kFewLights = 64;  // of more, most are minor to most receivers

[[noreturn]] void refuse(const char* name) {
  throw FormatError("snapshot: array \"" + std::string(name) +
                    "\" holds a value that no session writes; the file is damaged");
}

}  // namespace

size_t DirectLight::bytes() const {
  size_t sum = sums_.capacity() * sizeof(int64_t) + partial_.capacity() * sizeof(StoredView) +
               unused_.capacity() * sizeof(uint32_t);
  for (const DirectChange& change : recent_)
    sum += change.boxes.capacity() * sizeof(Box) +
           (change.lights.capacity() + change.samples.capacity()) * sizeof(uint32_t);
  for (const Column& column : columns_)
    sum += column.weight.capacity() * sizeof(int64_t) + column.view.capacity() * sizeof(uint32_t) +
           column.error.capacity() * sizeof(uint16_t);
  return sum;
}

size_t DirectLight::forecast_bytes(size_t samples, uint32_t group_count,
                                   std::span<const trace::Light> lights,
                                   std::span<const uint8_t> sampled) {
  double per_sample = 3.0 * sizeof(int64_t) * group_count;  // as if a group had one quantum
  for (size_t i = 0; i < lights.size(); ++i) {
    if (!sampled[i]) continue;
    per_sample += sizeof(int64_t) + sizeof(uint32_t);
    if (lights[i].area > 0) per_sample += kPartialShare * sizeof(StoredView) + sizeof(uint16_t);
  }
  return size_t(per_sample * double(samples));
}

double DirectLight::estimated_rays(const trace::Light& light, size_t samples, size_t lights) {
  if (!(light.area > 0)) return double(samples);
  const bool minor = lights > kFewLights;
  return double(samples) *
         (kFacingShare * (kCorners + (minor ? kCoarseRays / 3.0 : double(kCoarseRays))) +
          kPartialShare * (minor ? kCoarseRays : kFineRays) +
          kRaysPerTriangle * double(light.world.size()));
}

void DirectLight::each_word(const std::function<void(uint64_t)>& visit) const {
  for (const int64_t sum : sums_) visit(uint64_t(sum));
  for (const Column& column : columns_)
    for (size_t i = 0; i < column.weight.size(); ++i) {
      const FixedView view = view_of(column, i);
      visit(uint64_t(column.weight[i]));
      visit(column.error.empty() ? 0 : column.error[i]);
      visit(uint64_t(view.kind));
      if (view.kind != FixedView::Kind::partial) continue;
      visit(view.coarse);
      for (const uint64_t rays : view.fine) visit(rays);
      visit(uint64_t(view.divided));
      visit(std::bit_cast<uint64_t>(view.seen.share));
      visit(std::bit_cast<uint32_t>(view.seen.error));
    }
}

void DirectLight::save(ArchiveView& archive) const {
  archive.append("direct.weights", std::span<const int64_t>());
  archive.append("direct.views", std::span<const uint32_t>());
  archive.append("direct.errors", std::span<const uint16_t>());
  // Changes are not saved; lights that are not up to date are recomputed after loading.
  std::vector<uint8_t> behind;
  for (const Column& column : columns_) {
    archive.append("direct.weights", column.weight);
    archive.append("direct.views", column.view);
    archive.append("direct.errors", column.error);
    behind.push_back(!current(column));
  }
  archive.append("direct.partial", partial_);
  archive.keep("direct.behind", behind);
}

void DirectLight::clear(std::span<const trace::Light> lights, std::span<const uint8_t> sampled) {
  check(lights, sampled);
  DirectLight fresh(samples_, scales_, seed_);
  fresh.append_columns(lights, sampled);
  *this = std::move(fresh);
}

void DirectLight::restore_samples(size_t first, size_t count, ArchiveSource& archive) {
  size_t pairs = 0;
  size_t errors = 0;
  for (const Column& column : columns_) {
    pairs += column.weight.empty() ? 0 : count;
    errors += column.error.empty() ? 0 : count;
  }
  archive.expect<int64_t>("direct.weights", pairs);
  archive.expect<uint32_t>("direct.views", pairs);
  archive.expect<uint16_t>("direct.errors", errors);
  const size_t places = archive.count<StoredView>("direct.partial"), base = partial_.size();
  if (places > pairs) refuse("direct.partial");
  const auto partial = archive.read_all<StoredView>("direct.partial", places);
  for (const StoredView& own : partial)
    if (!(own.share >= 0 && own.share <= 1)) refuse("direct.partial");
  partial_.insert(partial_.end(), partial.begin(), partial.end());
  std::vector<bool> used(places);
  for (Column& column : columns_) {
    if (column.weight.empty()) continue;
    const auto weight = std::span(column.weight).subspan(first, count);
    const auto view = std::span(column.view).subspan(first, count);
    archive.read("direct.weights", weight);
    archive.read("direct.views", view);
    if (!column.error.empty()) {
      const auto error = std::span(column.error).subspan(first, count);
      archive.read("direct.errors", error);
      for (const uint16_t code : error)
        if (code > kMaxErrorCode) refuse("direct.errors");
    }
    for (size_t i = 0; i < count; ++i) {
      if (weight[i] < 0 || weight[i] > int64_t(kMaxWeight)) refuse("direct.weights");
      if (is_kind(view[i]) ? kind_of(view[i]) > FixedView::Kind::open
                           : view[i] >= places || used[view[i]])
        refuse("direct.views");
      if (!is_kind(view[i])) {
        used[view[i]] = true;
        view[i] += uint32_t(base);
      }
      add(column, first + i, weight[i], 1);
    }
  }
  for (uint32_t place = 0; place < places; ++place)
    if (!used[place]) unused_.push_back(uint32_t(base) + place);
}

void DirectLight::restore(ArchiveSource& archive, std::span<const trace::Light> lights,
                          std::span<const uint8_t> sampled) {
  const size_t pairs = samples_ * size_t(std::count_if(sampled.begin(), sampled.end(),
                                                       [](uint8_t yes) { return yes != 0; }));
  archive.expect<int64_t>("direct.weights", pairs);  // before memory for them is allocated
  DirectLight fresh(samples_, scales_, seed_);
  fresh.clear(lights, sampled);
  fresh.restore_samples(0, samples_, archive);
  const auto begins = archive.read_all<uint8_t>("direct.behind", lights.size());
  DirectChange anew;
  for (uint32_t light = 0; light < lights.size(); ++light) {
    if (begins[light] > sampled[light]) refuse("direct.behind");
    if (begins[light]) anew.lights.push_back(light);
  }
  if (!anew.lights.empty()) {
    for (size_t light = 0; light < lights.size(); ++light)
      fresh.columns_[light].taken = !begins[light];
    fresh.recent_.push_back(std::move(anew));
  }
  *this = std::move(fresh);
}

}  // namespace deltalux::direct
