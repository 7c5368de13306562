// SPDX-License-Identifier: Apache-2.0
// Size and snapshot of direct light.
#include <cstring>

#include "base/error.h"
#include "direct/direct_light.h"
#include "direct/view_code.h"

namespace deltalux::direct {
namespace {

// Measured in the office, the exhibition hall and the atrium: the share of pairs where sample and
// light face each other (0.60 to 0.66), the share that static geometry parts (0.03, 0.14, 0.21),
// and what a triangle costs in closed form, in shadow rays.
constexpr double kFacingShare = 0.6, kPartialShare = 0.15, kRaysPerTriangle = 0.2;

template <class T>
void append(std::vector<std::byte>& out, const std::vector<T>& values) {
  const size_t before = out.size();
  out.resize(before + values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(out.data() + before, values.data(), values.size() * sizeof(T));
}

/// Reads arrays one after the other.
class Reader {
 public:
  Reader(const Archive& archive, const std::string& name) : name_(name) {
    const auto entry = archive.find(name);
    if (entry == archive.end())
      throw FormatError("snapshot: array \"" + name + "\" is missing; the file is damaged");
    bytes_ = entry->second;
  }
  template <class T>
  void read(std::vector<T>& out, size_t count) {
    if (bytes_.size() / sizeof(T) < count) fail();
    out.resize(count);
    if (count) std::memcpy(out.data(), bytes_.data(), count * sizeof(T));
    bytes_ = bytes_.subspan(count * sizeof(T));
  }
  size_t left() const { return bytes_.size(); }
  void finish() const {
    if (left()) fail();
  }

 private:
  [[noreturn]] void fail() const {
    throw FormatError("snapshot: array \"" + name_ +
                      "\" does not have the size that its samples and lights call for; the file is "
                      "damaged or of another scene");
  }
  std::string name_;
  std::span<const std::byte> bytes_;
};

}  // namespace

size_t DirectLight::bytes() const {
  size_t sum = sums_.capacity() * sizeof(int64_t) + partial_.capacity() * sizeof(PartialView) +
               unused_.capacity() * sizeof(uint32_t);
  for (const Change& change : recent_)
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
    if (lights[i].kind == scene::LightKind::area) per_sample += kPartialShare * sizeof(PartialView);
  }
  return size_t(per_sample * double(samples));
}

double DirectLight::estimated_rays(const trace::Light& light, size_t samples) {
  if (light.kind != scene::LightKind::area) return double(samples);
  return double(samples) * (kFacingShare * (kCoarseRays + kCorners) + kPartialShare * kFineRays +
                            kRaysPerTriangle * double(light.world.size()));
}

void DirectLight::save(Archive& archive) const {
  std::vector<std::byte>& weights = archive["direct.weights"];
  std::vector<std::byte>& views = archive["direct.views"];
  std::vector<PartialView> partial;  // without the unused places
  for (const Column& column : columns_) {
    append(weights, column.weight);
    std::vector<uint32_t> codes = column.view;
    for (uint32_t& code : codes)
      if (!is_kind(code)) {
        partial.push_back(partial_[code]);
        code = uint32_t(partial.size() - 1);
      }
    append(views, codes);
  }
  append(archive["direct.partial"], partial);
  // Lights with changes to take in begin anew: the changes are not written.
  std::vector<uint8_t> behind;
  for (const Column& column : columns_) behind.push_back(!current(column));
  append(archive["direct.behind"], behind);
}

void DirectLight::restore(const Archive& archive, std::span<const trace::Light> lights,
                          std::span<const uint8_t> sampled) {
  check(lights, sampled);
  DirectLight fresh(samples_, group_count_, quantum_, seed_);
  fresh.columns_ = make_columns(lights, sampled, 0);
  Reader weights(archive, "direct.weights"), views(archive, "direct.views"),
      partial(archive, "direct.partial"), behind(archive, "direct.behind");
  partial.read(fresh.partial_, partial.left() / sizeof(PartialView));
  partial.finish();
  size_t next = 0;  // save() numbers partial views in order
  for (Column& column : fresh.columns_) {
    weights.read(column.weight, column.weight.size());
    views.read(column.view, column.view.size());
    for (size_t i = 0; i < column.view.size(); ++i) {
      const uint32_t code = column.view[i];
      const bool known = is_kind(code) ? kind_of(code) <= FixedView::Kind::open
                                       : code == next++ && next <= fresh.partial_.size();
      if (!known || column.weight[i] < 0 || column.weight[i] > kMostWeight)
        throw FormatError(
            "snapshot: array \"direct.views\" or \"direct.weights\" holds a value "
            "that no session writes; the file is damaged");
      fresh.add(column, i, column.weight[i], 1);
    }
  }
  weights.finish();
  views.finish();
  std::vector<uint8_t> begins;
  behind.read(begins, lights.size());
  behind.finish();
  Change anew;
  for (uint32_t light = 0; light < lights.size(); ++light)
    if (begins[light]) anew.lights.push_back(light);
  if (!anew.lights.empty()) {
    for (size_t light = 0; light < lights.size(); ++light)
      fresh.columns_[light].taken = !begins[light];
    fresh.recent_.push_back(std::move(anew));
  }
  *this = std::move(fresh);
}

}  // namespace deltalux::direct
