// SPDX-License-Identifier: Apache-2.0
// Places receivers, and passes to direct light what edits change.
#include "session/direct/direct_layer.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "direct/receivers.h"
#include "samples/placement.h"
#include "session/world/snapshot_check.h"

namespace deltalux::session {

/// A third of what well lit samples get from all lights, if nothing hides these. Suns, which may be
/// hidden everywhere, do not count, nor do samples that move, so that it does not depend on their
/// poses.
double DirectLayer::choose_reference() const {
  constexpr size_t kAsked = 400, kAbove = 10;
  direct::Shapes shapes;
  for (uint32_t i = 0; i < world.loaded_lights.size(); ++i)
    if (const trace::Light& light = world.loaded_lights[i]; !light.is_parallel())
      shapes.push_back(direct::shape_of(light, i, world.options.seed));
  const size_t n = world.samples.size(), step = std::max<size_t>(1, n / kAsked);
  std::vector<double> sums;
  for (size_t i = 0; i < n; i += step) {
    if (world.samples.attached[i] != scene::kNone) continue;
    double sum = 0;
    const direct::Receiver receiver = receiver_of(i);
    for (const auto& shape : shapes) sum += shape->about(receiver) * shape->brightest();
    if (sum > 0) sums.push_back(sum);
  }
  if (sums.empty()) return 0;
  const auto high = sums.end() - 1 - long(sums.size() / kAbove);
  std::nth_element(sums.begin(), high, sums.end());
  return *high / 3;
}

std::unique_ptr<direct::DirectLight> DirectLayer::make() const {
  return std::make_unique<direct::DirectLight>(world.evaluates() ? world.samples.size() : 0,
                                               *scales, world.options.seed);
}

direct::Receiver DirectLayer::receiver_of(size_t sample) const {
  const uint32_t object = world.samples.attached[sample];
  const Pose pose = object != scene::kNone ? world.scene.objects[object].pose : Pose{};
  // Shadow rays start at the samples' points, not at the discs' centres: these are lifted, nearer
  // to the lights.
  const Vec3f point = world.samples.point[sample], normal = world.samples.normal[sample];
  direct::Receiver own{pose.point(point), pose.direction(normal), object, world.slack[sample],
                       direct::place_key(point, normal)};
  own.point = direct::onto_sheets(*world.caster, object, own.point, own.normal, own.slack());
  return own;
}

void DirectLayer::choose_scales() {
  scales = direct::choose_scales(world.loaded_lights,
                                 double(samples::scene_metre(world.scene, *world.caster)));
  scales->reference = choose_reference();
}

void DirectLayer::place(const std::vector<uint8_t>* changed) {
  receivers.resize(world.samples.size());
  world.workers.for_blocks(receivers.size(), 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t object = world.samples.attached[i];
      if (changed && !(object != scene::kNone && (*changed)[object])) continue;
      receivers[i] = receiver_of(i);
    }
  });
}

void DirectLayer::compute(Progress& progress, bool leave) {
  if (!scales) choose_scales();
  auto fresh = make();
  if (world.evaluates()) {
    place();
    if (leave)
      fresh->clear(world.lights, world.light_sampled);
    else
      fresh->compute({*world.caster, world.lights, world.light_sampled, receivers}, world.workers,
                     progress);
  }
  light = std::move(fresh);
}

void DirectLayer::update(const trace::Change& edit, std::span<const ObjectChange> changes,
                         size_t old_lights, double budget_ms, Progress& progress) {
  if (!world.evaluates()) return;
  if (edit.empty() && light->current_share() == 1) return;
  direct::DirectChange change;
  std::vector<uint8_t> changed(world.scene.objects.size());
  for (const ObjectChange& c : changes) changed[c.object] = 1;
  change.boxes = boxes_of(changes);
  for (uint32_t i = 0; i < world.lights.size(); ++i)
    if (edit.lights[i]) change.lights.push_back(i);
  change.samples = moved_samples(world, changes);
  place(&changed);
  // Also needed if only the number of lights changed: DirectLight keeps an entry for every light,
  // even for those whose direct light comes from paths.
  if (old_lights != world.lights.size() ||
      std::any_of(world.light_sampled.begin(), world.light_sampled.end(),
                  [](uint8_t yes) { return yes; }))
    light->update({*world.caster, world.lights, world.light_sampled, receivers}, change,
                  world.workers, progress, budget_ms);
}

std::unique_ptr<direct::DirectLight> DirectLayer::at(std::span<const direct::Receiver> others,
                                                     std::span<const uint8_t> lights) const {
  Progress part;
  auto out = std::make_unique<direct::DirectLight>(others.size(), *scales, world.options.seed);
  out->compute({*world.caster, world.lights, lights, others}, world.workers, part);
  return out;
}

void DirectLayer::digest(Lanes& lanes) const {
  light->each_word([&](uint64_t word) { lanes.chain(word); });
}

void DirectLayer::save_choices(ArchiveView& archive) const {
  archive.keep("direct.scales",
               std::vector<double>{light->scales().quantum, light->scales().reference});
}

void DirectLayer::save(ArchiveView& archive) const {
  if (world.evaluates()) light->save(archive);
}

void DirectLayer::restore(ArchiveSource& archive) {
  const auto stored = archive.read_all<double>("direct.scales", 2);
  direct::Scales fixed = direct::choose_scales(
      world.loaded_lights, double(samples::scene_metre(world.scene, *world.caster)));
  snapshot::check_quantum("direct.scales", stored[0], fixed.quantum);
  if (!(stored[1] >= 0 && std::isfinite(stored[1])))
    throw FormatError(
        "snapshot: array \"direct.scales\" holds a value that no session writes; the "
        "file is damaged");
  fixed.quantum = stored[0], fixed.reference = stored[1];
  scales = fixed;
  auto fresh = make();
  if (world.evaluates()) {
    fresh->restore(archive, world.lights, world.light_sampled);
    place();
  }
  light = std::move(fresh);
}

std::vector<Vec3d> irradiance_of(const direct::DirectLight& light, std::span<const double> factors,
                                 size_t first, size_t count) {
  const std::span parts = light.parts();
  const size_t all = parts.empty() ? 0 : light.sums().size() / (3 * parts.size());
  std::vector<Vec3d> irradiance(count);
  for (size_t i = 0; i < count; ++i)
    for (size_t part = 0; part < parts.size(); ++part)
      for (int c = 0; c < 3; ++c)
        irradiance[i][c] += factors[parts[part].group] * parts[part].quantum *
                            double(light.sums()[3 * (part * all + first + i) + size_t(c)]);
  return irradiance;
}

}  // namespace deltalux::session
