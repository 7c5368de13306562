// SPDX-License-Identifier: Apache-2.0
// The session's side of direct light by shadow rays: which lights use it, where the receivers are,
// what edits change.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "direct/receivers.h"
#include "samples/placement.h"
#include "session/session.h"
#include "session/snapshot_check.h"

namespace deltalux::session {
namespace {

// All shadow rays are worth at least this many gather rays per sample, and each of those as many
// shadow rays: a gather ray takes about a microsecond with its chain, a shadow ray 40 ns.
constexpr double kWorthRays = 256, kPerGatherRay = 200;

}  // namespace

/// A third of what well lit samples get from all lights, if nothing hides these. Suns, which may be
/// hidden everywhere, do not count, nor do samples that move, so that it does not depend on their
/// poses.
double Session::choose_direct_reference() const {
  constexpr size_t kAsked = 400, kAbove = 10;
  const State& s = *state_;
  std::vector<direct::LightShape> shapes;
  for (uint32_t i = 0; i < s.lights.size(); ++i)
    if (!s.lights[i].is_parallel()) shapes.emplace_back(s.lights[i], i, s.options.seed);
  const size_t n = s.samples.size(), step = std::max<size_t>(1, n / kAsked);
  std::vector<double> sums;
  for (size_t i = 0; i < n; i += step) {
    if (s.samples.attached[i] != scene::kNone) continue;
    double sum = 0;
    const direct::Receiver receiver = receiver_of(i);
    for (const direct::LightShape& shape : shapes) sum += shape.about(receiver) * shape.brightest();
    if (sum > 0) sums.push_back(sum);
  }
  if (sums.empty()) return 0;
  const auto high = sums.end() - 1 - long(sums.size() / kAbove);
  std::nth_element(sums.begin(), high, sums.end());
  return *high / 3;
}

std::unique_ptr<direct::DirectLight> Session::make_direct(const direct::Scales& scales) const {
  const State& s = *state_;
  return std::make_unique<direct::DirectLight>(s.evaluates() ? s.samples.size() : 0, scales,
                                               s.options.seed);
}

void Session::choose_direct() {
  State& s = *state_;
  s.light_sampled.assign(s.lights.size(), s.options.direct == DirectMode::sampled);
  if (s.options.direct != DirectMode::automatic) return;
  // A shadow ray costs a tenth to a thirtieth of a segment that is traced, stored and deposited.
  // Shadow rays may cost as much as the paths; lights with most power per ray come first. With a
  // final gather, direct light by discs would dominate the error, and one light by discs costs the
  // discs of all; so shadow rays may cost several times what the gather rays do.
  const double gathered =
      s.options.gather_rays ? std::max(kWorthRays, double(s.options.gather_rays)) : 0.0;
  double budget = std::max(15.0 * double(forecast_.segments),
                           kPerGatherRay * gathered * double(s.samples.size()));
  std::vector<size_t> order(s.lights.size());
  std::iota(order.begin(), order.end(), size_t(0));
  const auto rays = [&](size_t i) {
    return direct::DirectLight::estimated_rays(s.lights[i], s.samples.size(), s.lights.size());
  };
  const auto worth = [&](size_t i) {
    const Vec3d p = s.lights[i].power * s.lights[i].max_power;
    return (p.x + p.y + p.z) / std::max(1.0, rays(i));
  };
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return worth(a) != worth(b) ? worth(a) > worth(b) : a < b; });
  for (size_t i : order) {
    if (rays(i) > budget) continue;
    budget -= rays(i);
    s.light_sampled[i] = 1;
  }
}

direct::Receiver Session::receiver_of(size_t sample) const {
  const State& s = *state_;
  const uint32_t object = s.samples.attached[sample];
  const Pose pose = object != scene::kNone ? s.scene.objects[object].pose : Pose{};
  // Shadow rays start at the samples' points, not at the discs' centres: these are lifted, nearer
  // to the lights.
  const Vec3f point = s.samples.point[sample], normal = s.samples.normal[sample];
  direct::Receiver own{pose.point(point), pose.direction(normal), object, s.slack[sample],
                       direct::place_key(point, normal)};
  own.point = direct::onto_sheets(*s.caster, object, own.point, own.normal, own.slack());
  return own;
}

void Session::place_receivers(const std::vector<uint8_t>* changed) {
  const State& s = *state_;
  receivers_.resize(s.samples.size());
  s.workers.for_blocks(receivers_.size(), 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t object = s.samples.attached[i];
      if (changed && !(object != scene::kNone && (*changed)[object])) continue;
      receivers_[i] = receiver_of(i);
    }
  });
}

void Session::compute_direct(Progress& progress, bool leave) {
  State& s = *state_;
  if (!s.direct_scales) {
    direct::Scales fixed =
        direct::choose_scales(s.lights, double(samples::scene_metre(s.scene, *s.caster)));
    fixed.reference = choose_direct_reference();
    s.direct_scales = fixed;
  }
  auto fresh = make_direct(*s.direct_scales);
  if (s.evaluates()) {
    place_receivers(nullptr);
    if (leave)
      fresh->clear(s.lights, s.light_sampled);
    else
      fresh->compute({*s.caster, s.lights, s.light_sampled, receivers_}, s.workers, progress);
  }
  direct_ = std::move(fresh);
}

void Session::update_direct(std::span<const ObjectChange> changes, size_t old_lights,
                            double budget_ms, Progress& progress) {
  const State& s = *state_;
  if (!s.evaluates()) return;
  if (changes.empty() && old_lights == s.lights.size() && direct_->current_share() == 1) return;
  direct::DirectChange change;
  std::vector<uint8_t> changed(s.scene.objects.size());
  for (const ObjectChange& c : changes) changed[c.object] = 1;
  change.boxes = boxes_of(changes);
  for (uint32_t i = 0; i < s.lights.size(); ++i) {
    const uint32_t object = s.lights[i].object;
    if (i >= old_lights || (object != scene::kNone && changed[object])) change.lights.push_back(i);
  }
  change.samples = moved_samples(s, changes);
  place_receivers(&changed);
  // Also needed if only the number of lights changed: DirectLight keeps an entry for every light,
  // even for those whose direct light comes from paths.
  if (old_lights != s.lights.size() ||
      std::any_of(s.light_sampled.begin(), s.light_sampled.end(), [](uint8_t yes) { return yes; }))
    direct_->update({*s.caster, s.lights, s.light_sampled, receivers_}, change, s.workers, progress,
                    budget_ms);
}

void Session::restore_direct(ArchiveSource& archive) {
  const State& s = *state_;
  const auto scales = archive.read_all<double>("direct.scales", 2);
  direct::Scales fixed =
      direct::choose_scales(s.lights, double(samples::scene_metre(s.scene, *s.caster)));
  snapshot::check_quantum("direct.scales", scales[0], fixed.quantum);
  if (!(scales[1] >= 0 && std::isfinite(scales[1])))
    throw FormatError(
        "snapshot: array \"direct.scales\" holds a value that no session writes; the "
        "file is damaged");
  fixed.quantum = scales[0], fixed.reference = scales[1];
  state_->direct_scales = fixed;
  auto fresh = make_direct(fixed);
  if (s.evaluates()) {
    fresh->restore(archive, s.lights, s.light_sampled);
    place_receivers(nullptr);
  }
  direct_ = std::move(fresh);
}

}  // namespace deltalux::session
