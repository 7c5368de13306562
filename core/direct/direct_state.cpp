// SPDX-License-Identifier: Apache-2.0
// Memory and snapshots of direct light.
#include <algorithm>

#include "base/error.h"
#include "direct/direct_light.h"
#include "direct/view_code.h"

namespace deltalux::direct {
namespace {

// Measured in the office, the exhibition hall and the atrium: the share of (sample, light) pairs
// that face each other (0.60 to 0.66), the share of pairs with partial visibility of the light due
// to static geometry (0.03, 0.14, 0.21), and the cost of a triangle's closed form, in shadow rays.
constexpr double kFacingShare = 0.6, kPartialShare = 0.15, kRaysPerTriangle = 0.2;

[[noreturn]] void refuse(const char* name) {
  throw FormatError("snapshot: array \"" + std::string(name) +
                    "\" holds a value that no session writes; the file is damaged");
}

}  // namespace

size_t DirectLight::bytes() const {
  size_t sum = sums_.capacity() * sizeof(int64_t) + partial_.capacity() * sizeof(PartialView) +
               unused_.capacity() * sizeof(uint32_t);
  for (const DirectChange& change : recent_)
    sum += change.boxes.capacity() * sizeof(Box) +
           (change.lights.capacity() + change.samples.capacity()) * sizeof(uint32_t);
  for (const Column& column : columns_)
    sum += column.weight.capacity() * sizeof(int64_t) + column.view.capacity() * sizeof(uint32_t);
  return sum;
}

size_t DirectLight::forecast_bytes(size_t samples, uint32_t group_count,
                                   std::span<const trace::Light> lights,
                                   std::span<const uint8_t> sampled) {
  double per_sample = 3.0 * sizeof(int64_t) * group_count;
  for (size_t i = 0; i < lights.size(); ++i) {
    if (!sampled[i]) continue;
    per_sample += sizeof(int64_t) + sizeof(uint32_t);
    if (lights[i].is_area()) per_sample += kPartialShare * sizeof(PartialView);
  }
  return size_t(per_sample * double(samples));
}

double DirectLight::estimated_rays(const trace::Light& light, size_t samples) {
  if (!light.is_area()) return double(samples);
  return double(samples) * (kFacingShare * (kCoarseRays + kCorners) + kPartialShare * kFineRays +
                            kRaysPerTriangle * double(light.world.size()));
}

void DirectLight::save(ArchiveView& archive) const {
  archive.append("direct.weights", std::span<const int64_t>());
  archive.append("direct.views", std::span<const uint32_t>());
  // Changes are not saved; lights that are not up to date are recomputed after loading.
  std::vector<uint8_t> behind;
  for (const Column& column : columns_) {
    archive.append("direct.weights", column.weight);
    archive.append("direct.views", column.view);
    behind.push_back(!current(column));
  }
  archive.append("direct.partial", partial_);
  archive.keep("direct.behind", behind);
}

void DirectLight::restore(ArchiveSource& archive, std::span<const trace::Light> lights,
                          std::span<const uint8_t> sampled) {
  check(lights, sampled);
  const size_t pairs = samples_ * size_t(std::count_if(sampled.begin(), sampled.end(),
                                                       [](uint8_t yes) { return yes != 0; }));
  archive.expect<int64_t>("direct.weights", pairs);
  archive.expect<uint32_t>("direct.views", pairs);
  DirectLight fresh(samples_, group_count_, quantum_, seed_);
  fresh.columns_ = make_columns(lights, sampled, 0);
  const size_t places = archive.count<PartialView>("direct.partial");
  if (places > pairs) refuse("direct.partial");
  fresh.partial_ = archive.read_all<PartialView>("direct.partial", places);
  for (const PartialView& partial : fresh.partial_)
    if (!(partial.share >= 0 && partial.share <= 1)) refuse("direct.partial");
  std::vector<bool> used(places);
  for (Column& column : fresh.columns_) {
    archive.read("direct.weights", std::span(column.weight));
    archive.read("direct.views", std::span(column.view));
    for (size_t i = 0; i < column.view.size(); ++i) {
      const uint32_t code = column.view[i];
      if (column.weight[i] < 0 || column.weight[i] > int64_t(kMaxWeight)) refuse("direct.weights");
      if (is_kind(code) ? kind_of(code) > FixedView::Kind::open : code >= places || used[code])
        refuse("direct.views");
      if (!is_kind(code)) used[code] = true;
      fresh.add(column, i, column.weight[i], 1);
    }
  }
  for (uint32_t place = 0; place < places; ++place)
    if (!used[place]) fresh.unused_.push_back(place);
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
