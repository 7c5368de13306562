// SPDX-License-Identifier: Apache-2.0
// The session's side of the final gather: cells, guides, gather rays, and what edits change of
// them.
#include <numeric>
#include <utility>

#include "base/random.h"
#include "direct/receivers.h"
#include "gather/choose/find_beams.h"
#include "gather/choose/find_guides.h"
#include "gather/choose/find_portals.h"
#include "samples/placement.h"
#include "session/bake/choice_light.h"
#include "session/flow/edit_log.h"
#include "session/flow/landings.h"
#include "session/read/unreached.h"
#include "session/session.h"
#include "session/session_forecast.h"

namespace deltalux::session {
namespace {

constexpr size_t kGrain = 64;
// places from which the memory of all rays is predicted, approximately
constexpr size_t kPlaces = 512;

/// Casts a few rays from these receivers, to predict the memory of all rays.
gather::Looks::PerRay few_rays(const gather::Present& present, uint64_t seed,
                               const Workers& workers) {
  constexpr uint32_t kRays = 32;
  const std::vector<int8_t> as_told(present.receivers.size());
  gather::Looks looks({as_told, kRays}, seed);
  Progress part;
  looks.cast(present, workers, part);
  return looks.per_ray();
}

}  // namespace

void lay_out_cell_sums(State& s) {
  if (!s.gather) return;
  gather::CellSums& sums = s.gather->sums;
  sums.batches = kBatches;
  sums.set_groups(uint32_t(s.sum_groups.size()));
  sums.quanta.resize(sums.at(s.gather->cells.size(), 0, 0), 0);
  sums.touched.resize(s.gather->cells.size(), 1);
}

void Session::make_cells(Progress& progress) {
  State& s = *state_;
  s.gather.reset();
  kept_.reset();
  if (!s.options.gather_rays) return;
  progress.begin("divide surfaces", 1);
  s.gather = std::make_unique<Gather>(
      Gather{gather::Cells(s.scene, *s.caster, samples::scene_metre(s.scene, *s.caster), progress),
             {},
             {},
             {},
             gather::Looks({}, s.options.seed),
             {}});
  grow_cell_sums(progress);
}

void Session::grow_cell_sums(const Progress& progress) {
  State& s = *state_;
  if (!s.gather) return;
  for (uint32_t i = uint32_t(s.gather->cells.objects()); i < s.scene.objects.size(); ++i)
    s.gather->cells.add_object(s.scene, i, progress);
  s.gather->cells.expose(s.scene, *s.caster, s.workers, progress);
  lay_out_cell_sums(s);
}

void Session::grow_sums(const Progress& progress) {
  grow_cell_sums(progress);
  lay_out_sums();
}

void Session::shrink_sums() noexcept {
  State& s = *state_;
  lay_out_sums();
  if (!s.gather) return;
  s.gather->cells.drop_objects(s.scene.objects.size());
  lay_out_cell_sums(s);
}

void Session::lay_out_sums() {
  if (told_) told_->set_groups(uint32_t(state_->sum_groups.size()));
  state_->discs.lay_out_sums();
}

gather::LitCells Session::lit_cells(const gather::Evaluation& now) const {
  const State& s = *state_;
  return {present(s.direct.receivers, s.guiding), now, s.gather->coverage.covered()};
}

gather::Evaluation Session::choose_guides(const FirstFlights& others, Progress& progress) {
  State& s = *state_;
  const auto survey = [&](const gather::Evaluation& now) {
    return gather::BrightnessSurvey(present(s.direct.receivers, s.guiding), now, lit_cells(now),
                                    s.options.seed, s.workers, progress);
  };
  // The cells counted the direct light of beams and suns, so that these could be found; remove it,
  // since gather rays compute it by shadow rays from now on.
  const auto choose = [&](const auto& chosen) {
    const Landings before(s);
    const std::vector<uint8_t> known = s.lights_by_shadow_ray();
    chosen();
    const Landings after(s);
    std::vector<uint32_t> slots(s.paths.store.bounce(0).size());
    std::iota(slots.begin(), slots.end(), 0u);
    before.add(0, slots, -1);
    after.add(0, slots, +1);
    const std::vector<uint8_t> asked = s.lights_by_shadow_ray();
    for (uint32_t light = 0; light < asked.size(); ++light)
      if (asked[light] && !known[light]) leave_out(light, others);
    place_beams_and_suns();
    return *evaluation(false);
  };
  gather::Evaluation now = *evaluation(false);
  gather::BrightnessSurvey found = survey(now);
  auto beams =
      gather::find_beams(present(s.direct.receivers, s.guiding), now, found, s.options.seed);
  if (!beams.empty()) {
    now = choose([&] { s.guiding.beams = std::move(beams); });
    found = survey(now);
  }
  // The hits still include what suns light.
  std::vector<uint32_t> suns = find_suns(found.hits, others);
  if (!suns.empty()) now = choose([&] { s.guiding.suns = std::move(suns); });
  std::vector<gather::Guide>& guides = s.guiding.guides;
  guides = gather::find_guides(present(s.direct.receivers, s.guiding), now, found, progress);
  const std::vector<gather::Guide> portals = gather::find_portals(
      present(s.direct.receivers, s.guiding), now, guides, s.options.seed, s.workers, progress);
  guides.resize(std::min(guides.size(), gather::kMaxGuides - portals.size()));
  guides.insert(guides.end(), portals.begin(), portals.end());
  return now;
}

std::vector<uint32_t> Session::find_suns(std::span<const uint32_t> hits,
                                         const FirstFlights& others) const {
  const Landings landings(*state_);
  const std::vector<trace::Light>& lights = state_->lights;
  std::vector<uint32_t> suns;
  for (uint32_t i = 0; i < lights.size(); ++i)
    if (lights[i].is_parallel() && lights[i].on &&
        landings.share_lit_by(i, hits, others) <= gather::Suns::kMaxLit)
      suns.push_back(i);
  return suns;
}

void Session::place_beams_and_suns() {
  State& s = *state_;
  s.gather->beams =
      gather::Beams(s.guiding.beams, s.scene, s.lights, *s.caster, s.gather->cells, s.options.seed);
  s.gather->suns = gather::Suns(s.guiding.suns, s.lights);
}

gather::SeenGuides Session::guides_at(const direct::Receiver& receiver, uint32_t rays) const {
  const State& s = *state_;
  return gather::see_guides(s.guiding.guides, s.gather->beams, receiver, rays, *s.caster,
                            s.options.seed);
}

gather::RayShares Session::share(size_t sample) const {
  return gather::share_rays(
      guides_at(state_->direct.receivers[sample], state_->options.gather_rays),
      state_->gather->looks.rays().count(sample));
}

void Session::renew_share(size_t sample) {
  State& s = *state_;
  if (!s.guiding.empty()) s.guiding.shares[sample] = share(sample);
}

std::vector<gather::SeenGuides> Session::guides_at(std::span<const direct::Receiver> receivers,
                                                   uint32_t rays, Progress& progress) const {
  const State& s = *state_;
  if (s.guiding.empty()) return {};
  std::vector<gather::SeenGuides> seen(receivers.size());
  s.workers.for_blocks(seen.size(), kGrain, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i) seen[i] = guides_at(receivers[i], rays);
    progress.advance(end - begin);
  });
  return seen;
}

void Session::cover_cells(Progress& progress) {
  const State& s = *state_;
  progress.begin("cover cells", 1);
  s.gather->coverage.compute(s.scene, *s.caster, s.gather->cells, s.workers);
}

void Session::look_around(Progress& progress, bool new_guides, const FirstFlights& others,
                          const std::function<void()>& chosen) {
  State& s = *state_;
  if (!s.gather || !s.evaluates()) return;
  cover_cells(progress);
  if (new_guides) {
    const ChoiceLight choice(s, choice_factors(s));
    const gather::Evaluation now = choose_guides(others, progress);
    if (chosen) chosen();
    aim(now, progress);
  } else {
    place_beams_and_suns();
    aim({}, progress);
  }
  s.gather->looks.cast(present(s.direct.receivers, s.guiding), s.workers, progress);
}

bool Session::choose_need(const gather::Evaluation& now) {
  State& s = *state_;
  const std::vector<direct::Receiver> places = gather::lit_places(lit_cells(now));
  s.guiding.need = {};
  if (places.empty()) return false;
  const uint32_t rays = s.options.gather_rays;
  const std::vector<Vec3d> direct =
      irradiance_of(*s.direct.at(places, s.light_sampled), s.group_factor, 0, places.size());
  Progress part;
  const std::vector<gather::SeenGuides> around = guides_at(places, rays, part);
  s.guiding.need = gather::RayNeed(pilots_of({places, around, direct}, rays, now), rays);
  return true;
}

void Session::choose_rays(const gather::Evaluation& now, std::span<const gather::SeenGuides> seen,
                          Progress& progress) {
  State& s = *state_;
  s.guiding.doublings.assign(s.direct.receivers.size(), 0);
  if (!choose_need(now)) return;
  const uint32_t rays = s.options.gather_rays;
  progress.begin("find noisy places", s.direct.receivers.size());
  const size_t together = seen_together(rays);
  for (size_t first = 0; first < s.direct.receivers.size(); first += together) {
    const size_t count = std::min(together, s.direct.receivers.size() - first);
    if (needs_pilots()) {
      const std::vector<Vec3d> straight =
          irradiance_of(*s.direct.light, s.group_factor, first, count);
      const std::vector<int8_t> own =
          piloted({std::span(s.direct.receivers).subspan(first, count),
                   s.guiding.empty() ? seen : seen.subspan(first, count), straight},
                  now);
      std::copy(own.begin(), own.end(), s.guiding.doublings.begin() + long(first));
    }
    progress.advance(count);
    progress.check();
  }
  fit_rays();
}

std::vector<int8_t> Session::piloted(const Places& places, const gather::Evaluation& now) const {
  const uint32_t rays = state_->options.gather_rays;
  return doublings_of(places.receivers, pilots_of(places, rays, now), rays);
}

void Session::fit_rays() {
  State& s = *state_;
  // Samples with more rays, or fewer, may start more chains per ray than others.
  const gather::RayCounts counts(s.guiding.doublings, s.options.gather_rays);
  std::vector<direct::Receiver> some;  // spaced evenly among all rays
  for (size_t i = 0; i < s.direct.receivers.size(); ++i)
    if (counts.first(i + 1) * kPlaces >= some.size() * counts.all())
      some.push_back(s.direct.receivers[i]);
  const double all = double(counts.all());
  const bool weighted = !s.guiding.empty();
  const size_t before = forecast_.bytes;
  forecast_.bytes = size_t(
      double(before) +
      all * few_rays(present(some, {}), s.options.seed ^ kPilotSeed, s.workers).bytes(weighted) -
      ray_bytes(s, forecast_, all, weighted));
  // If memory is short, all samples cast the standard number of rays, as was forecast.
  if (fits(counts)) return;
  forecast_.bytes = before;
  s.guiding.need = {};
  s.guiding.doublings.assign(s.direct.receivers.size(), 0);
}

gather::Looks::PerRay Session::pilot_rays() const {
  const State& s = *state_;
  std::vector<Vec3f> points, normals;
  const size_t stride = std::max<size_t>(1, s.samples.size() / kPlaces);
  for (size_t i = 0; i < s.samples.size(); i += stride) {
    const uint32_t object = s.samples.attached[i];
    const Pose pose = object == scene::kNone ? Pose{} : s.scene.objects[object].pose;
    points.push_back(pose.point(s.samples.point[i]));
    normals.push_back(pose.direction(s.samples.normal[i]));
  }
  const std::vector<direct::Receiver> receivers = receivers_at(points, normals);
  return few_rays(present(receivers, {}), s.options.seed ^ kPilotSeed, s.workers);
}

std::vector<gather::RayShares> Session::shares_of(std::span<const gather::SeenGuides> seen,
                                                  const gather::RayCounts& rays) const {
  std::vector<gather::RayShares> shares(seen.size());
  for (size_t i = 0; i < shares.size(); ++i) shares[i] = gather::share_rays(seen[i], rays.count(i));
  return shares;
}

void Session::aim(const std::optional<gather::Evaluation>& now, Progress& progress) {
  State& s = *state_;
  const uint32_t rays = s.options.gather_rays;
  if (!s.guiding.empty()) progress.begin("share rays", s.direct.receivers.size());
  const std::vector<gather::SeenGuides> seen = guides_at(s.direct.receivers, rays, progress);
  if (now) choose_rays(*now, seen, progress);
  s.gather->looks = uncast(seen);
}

gather::Looks Session::uncast(std::span<const gather::SeenGuides> seen) {
  State& s = *state_;
  gather::Looks looks({s.guiding.doublings, s.options.gather_rays}, s.options.seed);
  s.guiding.shares = shares_of(seen, looks.rays());
  return looks;
}

gather::Present Session::present(std::span<const direct::Receiver> receivers,
                                 const gather::Guiding& guiding) const {
  const State& s = *state_;
  const Gather& own = *s.gather;
  return {s.scene, *s.caster, s.lights, receivers, own.cells, guiding, own.beams, own.suns};
}

std::optional<gather::Evaluation> Session::evaluation(bool errors) const {
  const State& s = *state_;
  if (!s.gather) return std::nullopt;
  const std::vector<double> units = s.sum_units();
  Gather& own = *s.gather;
  const gather::CellState state{s.scene, own.cells, own.coverage, own.sums, units};
  gather::Paint paint;
  for (const scene::Material& material : s.scene.materials)
    paint.reflectance.push_back(material.reflectance);
  for (const trace::Light& light : s.lights)
    paint.dim.push_back(float(s.group_factor[light.group]));
  paint.dim.push_back(0);
  if (s.evaluates()) own.light.renew(state, s.workers);  // parts are told it, see join_look()
  own.looks.paint(paint, s.workers);
  gather::Evaluation out(state, own.light, std::move(paint), errors, s.workers);
  if (errors) out.allow_for(power_of_one_path(s));
  return out;
}

std::vector<direct::Receiver> Session::receivers_at(std::span<const Vec3f> points,
                                                    std::span<const Vec3f> normals) const {
  const State& s = *state_;
  return direct::receivers_at(s.scene, *s.caster, points, normals, kUnder * s.gather->cells.metre(),
                              s.workers);
}

void Session::restore_looks(ArchiveSource& archive, Progress& progress) {
  State& s = *state_;
  if (!s.gather) return;
  s.guiding.restore(archive, s.lights, s.evaluates() ? s.samples.size() : 0, s.options.gather_rays);
  const double rays = double(gather::RayCounts(s.guiding.doublings, s.options.gather_rays).all());
  const double bytes = rays * gather::Looks::PerRay{}.bytes();
  if (s.options.memory_limit && bytes > double(s.options.memory_limit))
    throw FormatError(
        std::string("\"gather.doublings\": its rays would need about ")
            .append(std::to_string(uint64_t(bytes) >> 20) + " MiB, the limit is ")
            .append(std::to_string(s.options.memory_limit >> 20) + " MiB; raise memory_limit"));
  const Landings landings(s);
  std::vector<uint32_t> slots;
  for (uint32_t b = 0; b < s.paths.store.bounces().size(); ++b) {
    slots.resize(s.paths.store.bounces()[b].size());
    std::iota(slots.begin(), slots.end(), 0u);
    landings.add(b, slots, +1);
  }
  if (!s.evaluates()) return;
  cover_cells(progress);
  place_beams_and_suns();
  if (s.guiding.shares.empty())
    aim({}, progress);
  else
    s.gather->looks = gather::Looks({s.guiding.doublings, s.options.gather_rays}, s.options.seed);
  s.gather->looks.restore(archive, present(s.direct.receivers, s.guiding), s.workers, progress);
}

void Session::note_beams(gather::Change& change) {
  State& s = *state_;
  gather::Beams& beams = s.gather->beams;
  change.points = beams.update(s.scene, s.lights, *s.caster, s.gather->cells, change.scene);
  if (!beams.placed(change.scene)) return;
  s.workers.for_blocks(s.samples.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      if (change.samples[i]) continue;  // Looks::follow() recomputes the shares of these
      const gather::RayShares own = share(i);
      change.samples[i] = !(own == s.guiding.shares[i]);
      s.guiding.shares[i] = own;
    }
  });
}

void Session::note_looks(const EditLog& log) {
  State& s = *state_;
  if (!s.gather || !s.evaluates()) return;
  gather::Change change{log.change(), std::vector<uint8_t>(s.samples.size()), {}};
  if (change.scene.empty()) return;
  for (uint32_t id : moved_samples(s, log.changes())) change.samples[id] = 1;
  s.gather->coverage.update(s.scene, *s.caster, s.gather->cells, change.scene, s.workers);
  note_beams(change);
  s.gather->suns = gather::Suns(s.guiding.suns, s.lights);
  if (kept_) kept_->note(change);
  s.gather->looks.note(present(s.direct.receivers, s.guiding), change);
}

}  // namespace deltalux::session
