// SPDX-License-Identifier: Apache-2.0
// Rays of samples and of other receivers are aimed and cast alike.
#include "session/rays/ray_layer.h"

#include "base/error.h"
#include "direct/receivers.h"

namespace deltalux::session {
namespace {

constexpr size_t kGrain = 64;

}  // namespace

std::vector<uint8_t> RayLayer::lights_by_shadow_ray() const {
  std::vector<uint8_t> asked(world.lights.size());
  for (const gather::BeamGuide& beam : guiding.beams) asked[beam.light] = 1;
  for (const uint32_t sun : guiding.suns) asked[sun] = 1;
  return asked;
}

gather::Evaluation RayLayer::evaluation(bool errors) {
  gather::Paint paint;
  for (const scene::Material& material : world.scene.materials) {
    paint.reflectance.push_back(material.reflectance);
    paint.contrast.push_back(material.contrast());
  }
  for (const trace::Light& light : world.lights) {
    const float dim = float(world.group_factor[light.group]);
    paint.dim.push_back(dim);
    paint.lamp.push_back(light.strength * dim);
  }
  cells.renew_light();
  paint.caustics = cells.light.caustics();
  hits.paint(paint, world.workers);
  const std::vector<double> units = world.cell_units();
  gather::Evaluation out(cells.state(units), cells.light, std::move(paint), errors, world.workers);
  if (errors) out.allow_for(cells.power_of_one_path());
  return out;
}

std::vector<direct::Receiver> RayLayer::receivers_at(std::span<const Vec3f> points,
                                                     std::span<const Vec3f> normals) const {
  return direct::receivers_at(world.scene, *world.caster, points, normals,
                              kUnder * cells.division.metre(), world.workers);
}

void RayLayer::place() {
  beams = gather::Beams(guiding.beams, world.scene, world.lights, *world.caster, cells.division,
                        world.options.seed);
  suns = gather::Suns(guiding.suns, world.lights);
}

std::vector<gather::SeenTargets> RayLayer::targets_at(std::span<const direct::Receiver> receivers,
                                                      uint32_t rays, Progress& progress) const {
  if (guiding.empty()) return {};
  const gather::Targets targets(guiding.guides, beams);
  std::vector<gather::SeenTargets> seen(receivers.size());
  world.workers.for_blocks(seen.size(), kGrain, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i)
      seen[i] = gather::see_targets(targets, receivers[i], rays, *world.caster, world.options.seed);
    progress.advance(end - begin);
  });
  return seen;
}

std::vector<gather::SeenTargets> RayLayer::targets_of_samples(Progress& progress) const {
  if (!guiding.empty()) progress.begin("share rays", direct.receivers.size());
  return targets_at(direct.receivers, world.options.gather_rays, progress);
}

gather::RayAllotment RayLayer::allotment(const gather::Targets& targets, size_t sample) const {
  return gather::allot_rays(
      gather::see_targets(targets, direct.receivers[sample], world.options.gather_rays,
                          *world.caster, world.options.seed),
      hits.rays().count(sample));
}

std::vector<gather::RayAllotment> RayLayer::allotments_of(std::span<const gather::SeenTargets> seen,
                                                          const gather::RayCounts& rays) const {
  std::vector<gather::RayAllotment> allotments(seen.size());
  for (size_t i = 0; i < allotments.size(); ++i)
    allotments[i] = gather::allot_rays(seen[i], rays.count(i));
  return allotments;
}

gather::Guiding RayLayer::guiding_of(std::span<const gather::SeenTargets> seen,
                                     const gather::RayCounts& rays) const {
  return {guiding.guides, guiding.beams, guiding.suns, {}, {}, allotments_of(seen, rays)};
}

gather::GatherHits RayLayer::uncast(std::span<const gather::SeenTargets> seen) {
  gather::GatherHits out({guiding.doublings, world.options.gather_rays}, world.options.seed);
  guiding.allotments = allotments_of(seen, out.rays());
  return out;
}

void RayLayer::cast(Progress& progress) {
  hits.cast(context(), world.workers, progress);
  hits.bound_chains(context(), world.workers);  // now, and not in the first update
}

gather::GatherHits RayLayer::hits_of(std::span<const direct::Receiver> receivers,
                                     const gather::Guiding& by, const gather::RayCounts& rays,
                                     uint64_t seed, const gather::Evaluation& now) const {
  Progress part;
  gather::GatherHits out(rays, seed);
  out.cast(context(receivers, by), world.workers, part);
  out.paint(now.paint(), world.workers);
  return out;
}

void RayLayer::note_beams(gather::Change& change) {
  change.points =
      beams.update(world.scene, world.lights, *world.caster, cells.division, change.scene);
  if (!beams.placed(change.scene)) return;
  const gather::Targets targets(guiding.guides, beams);
  world.workers.for_blocks(world.samples.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      if (change.samples[i]) continue;  // GatherHits::follow() recomputes the allotments of these
      const gather::RayAllotment own = allotment(targets, i);
      change.samples[i] = !(own == guiding.allotments[i]);
      guiding.allotments[i] = own;
    }
  });
}

void RayLayer::note(gather::Change& change) {
  note_beams(change);
  suns = gather::Suns(guiding.suns, world.lights);
  hits.note(context(), change);
}

gather::GatherHits::Cast RayLayer::follow(Progress& progress, const std::function<bool()>& more) {
  const gather::Targets targets(guiding.guides, beams);
  const auto renew = [&](size_t sample) {
    if (!guiding.empty()) guiding.allotments[sample] = allotment(targets, sample);
  };
  return hits.follow(context(), world.workers, progress, renew, more);
}

void RayLayer::clear() {
  hits = gather::GatherHits({}, world.options.seed);
  beams = {}, suns = {}, glance = {};
}

void RayLayer::save(ArchiveView& archive) const {
  if (!world.gathers()) return;
  guiding.save(archive, world.evaluates() && !(hits.pending_share() > 0));
  if (world.evaluates()) hits.save(archive);
}

void RayLayer::restore_choices(ArchiveSource& archive) {
  const Options& options = world.options;
  guiding.restore(archive, world.lights, world.evaluates() ? world.samples.size() : 0,
                  options.gather_rays);
  const double rays = double(gather::RayCounts(guiding.doublings, options.gather_rays).all());
  const double needed = rays * gather::GatherHits::PerRay{}.bytes();
  if (options.memory_limit && needed > double(options.memory_limit))
    throw FormatError("\"gather.doublings\": its rays would need about " + mebibytes(needed) +
                      ", the limit is " + mebibytes(double(options.memory_limit)) +
                      "; raise memory_limit");
}

void RayLayer::restore(ArchiveSource& archive, Progress& progress) {
  place();
  if (guiding.allotments.empty())
    hits = uncast(targets_of_samples(progress));
  else
    hits = gather::GatherHits({guiding.doublings, world.options.gather_rays}, world.options.seed);
  hits.restore(archive, context(), world.workers, progress);
}

}  // namespace deltalux::session
