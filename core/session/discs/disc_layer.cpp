// SPDX-License-Identifier: Apache-2.0
// Places discs, and finds what of them counts.
#include "session/discs/disc_layer.h"

#include <algorithm>
#include <numbers>

#include "base/assertion.h"
#include "samples/openness.h"
#include "samples/placement.h"
#include "session/world/ground.h"
#include "session/world/snapshot_check.h"

namespace deltalux::session {
namespace {

// Where objects touch, even less of a disc may be uncovered, and a single crossing would outshine
// the scene. With this least share, such samples (some per cent of the vertices of a furnished
// room) become darker.
constexpr float kMinShare = 0.01f;

/// Makes the estimators of placed discs, whose moving parts `sets` has already.
void release(PlacedDiscs& placed, std::span<const plan::PartPlan> plans, Progress& progress,
             DiscSets& sets) {
  sets.still = placed.pilots[0].release(plans[0].chosen, &progress);
  for (size_t i = 0; i < sets.moving.size(); ++i)
    sets.moving[i].index = placed.pilots[i + 1].release(plans[i + 1].chosen, &progress);
}

}  // namespace

size_t DiscSets::bytes() const {
  size_t sum = openness.capacity() * sizeof(float);
  if (still) sum += still->bytes();
  for (const MovingPart& part : moving) sum += part.index->bytes();
  return sum;
}

size_t DiscLayer::bytes() const {
  return DiscSets::bytes() + sums.capacity() * sizeof(int64_t) + sum_marks.capacity();
}

PlacedDiscs DiscLayer::place(Progress& progress, std::span<const float> openness_known) const {
  const auto [from, end] = world.own_samples();
  PlacedDiscs placed;
  placed.openness.assign(openness_known.begin(), openness_known.end());
  placed.openness.resize(world.samples.size(), 1.0f);
  each_ground(world, progress,
              [&](uint32_t object, std::vector<uint32_t> ids, const scene::Scene& scene,
                  const samples::Ground& ground) {
                samples::DiscSet discs =
                    samples::make_discs(world.samples, std::move(ids), world.options.disc_area,
                                        ground, world.workers, progress);
                if (openness_known.empty() && world.counts_openness())
                  samples::find_openness(discs, from, end, scene, ground.caster, world.workers,
                                         progress, placed.openness);
                if (object != scene::kNone) {
                  MovingPart part;
                  part.object = object;
                  for (size_t i = 0; i < discs.size(); ++i)
                    part.local.grow(Box{discs.centre[i], discs.centre[i]}.padded(discs.radius[i]));
                  placed.moving.push_back(std::move(part));
                }
                placed.pilots.emplace_back(std::move(discs), world.options.segment_end,
                                           world.workers);
              });
  return placed;
}

void DiscLayer::take(PlacedDiscs& placed, bool complete) {
  moving = std::move(placed.moving);
  openness = std::move(placed.openness);
  openness_complete = complete;
}

void DiscLayer::make_estimators(PlacedDiscs& placed, Progress& progress) {
  if (placed.pilots.empty())
    placed.pilots.emplace_back(samples::DiscSet{}, world.options.segment_end, world.workers);
  release(placed, plans, progress, *this);
}

void DiscLayer::take_choices(const DiscLayer& other) {
  static_cast<DiscSets&>(*this) = other;
  plans = other.plans;
  openness_complete = other.openness_complete;
}

void DiscLayer::clear_sums() {
  sums.assign(sum_count(), 0);
  sum_marks.clear();
  settle_parts();
}

void DiscLayer::settle_parts() {
  place_parts();
  for (MovingPart& part : moving) part.current = true;
}

void DiscLayer::lay_out_sums() {
  sums.resize(sum_count(), 0);
  if (!sum_marks.empty()) sum_marks.resize(mark_count(), 0);
}

estimate::EnergySums DiscLayer::energy() {
  estimate::EnergySums out{sums.data(), world.samples.size()};
  DELTALUX_ASSERT(sum_marks.empty() || sum_marks.size() == mark_count());
  if (!sum_marks.empty()) out.marks = sum_marks.data();
  return out;
}

void DiscLayer::place_part(MovingPart& part) const {
  const Pose& pose = world.scene.objects[part.object].pose;
  part.world = pose.box(part.local).padded(2 * world.caster->margin());
}

void DiscLayer::clear_part(const MovingPart& part) {
  const estimate::EnergySums own = energy();
  for (uint32_t slab = 0; slab < world.slabs(); ++slab)
    for (const uint32_t id : part.index->discs().id) {
      own.mark(slab, id);
      std::fill_n(own.cell(slab, id), 3, 0);
    }
}

void DiscLayer::refresh_areas(const std::vector<ObjectChange>* changes) {
  if (!world.counts_in_discs()) return;
  if (world.evaluates())
    find_areas(changes);
  else
    area.assign(world.samples.size(), 0.0f);
}

void DiscLayer::find_areas(const std::vector<ObjectChange>* changes) {
  std::vector<float> fresh = area;
  fresh.resize(world.samples.size(), 1.0f);
  const bool whole = world.options.disc_area == samples::DiscArea::whole;
  const auto refresh = [&](const samples::DiscSet& discs, const MovingPart* part) {
    const Pose pose = part ? world.scene.objects[part->object].pose : Pose{};
    samples::ForeignGeometry foreign{world.caster.get(), part != nullptr,
                                     part ? part->object : scene::kNone};
    const bool part_moved = part && changes &&
                            std::any_of(changes->begin(), changes->end(),
                                        [&](const auto& c) { return c.object == part->object; });
    world.workers.for_blocks(discs.size(), 512, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const Vec3f centre = part ? pose.point(discs.centre[i]) : discs.centre[i];
        bool touched = !changes || part_moved;
        for (size_t k = 0; changes && !touched && k < changes->size(); ++k)
          touched = (*changes)[k].before.touches_sphere(centre, discs.radius[i]) ||
                    (*changes)[k].after.touches_sphere(centre, discs.radius[i]);
        if (!touched) continue;
        bool reached = part != nullptr;
        for (uint32_t object : world.caster->present())
          reached = reached ||
                    world.caster->object_bounds(object).touches_sphere(centre, discs.radius[i]);
        const float counted = reached && !whole ? samples::uncovered_area(discs, i, pose, foreign)
                                                : samples::outline_area(discs, i);
        const float circle = std::numbers::pi_v<float> * discs.radius[i] * discs.radius[i];
        const float open = openness[discs.id[i]];
        fresh[discs.id[i]] =
            counted > 0 && open > 0 ? std::max(counted, kMinShare * circle) / open : 0.0f;
      }
    });
  };
  refresh(still->discs(), nullptr);
  for (const MovingPart& part : moving) refresh(part.index->discs(), &part);
  area = std::move(fresh);
}

void DiscLayer::digest(Lanes& lanes) const {
  if (!world.counts_in_discs()) return;
  lanes.chain_all(sums);
  lanes.chain_all(area);
  if (knows_openness()) lanes.chain_all(openness);
}

void DiscLayer::save_choices(ArchiveView& archive) const {
  if (!world.counts_in_discs()) return;
  if (knows_openness()) archive.append("openness", openness);
  archive.append("area", area);
}

void DiscLayer::save(ArchiveView& archive, bool own) const {
  if (!world.counts_in_discs()) return;
  if (own && world.holds_none())
    archive.keep("sums", std::vector<int64_t>(sums.size()));  // the parts store their own
  else
    archive.append("sums", sums);
}

PlacedDiscs DiscLayer::restore_choices(ArchiveSource& archive, Progress& progress) {
  std::vector<float> known;  // empty: this part of a bake that has only begun computes its own
  if (world.holds_all() || archive.bytes("openness"))
    known = archive.read_all<float>("openness", world.samples.size());
  snapshot::check_range("openness", known, 0, samples::kMaxOpenness);
  area = archive.read_all<float>("area", world.samples.size());
  snapshot::check_areas(area, world.samples.radius, known);
  PlacedDiscs placed = place(progress, known);
  take(placed, !known.empty());
  return placed;
}

void DiscLayer::restore(ArchiveSource& archive, size_t segments) {
  if (world.counts_in_discs()) sums = archive.read_all<int64_t>("sums", sum_count());
  snapshot::check_sums(sums, segments);
  settle_parts();
}

DiscsInPlace::DiscsInPlace(World& world, DiscLayer& discs, Progress& progress) : discs_(discs) {
  if (world.counts_in_discs()) return;
  if (!discs.spare) {
    world.resolve_radii(progress);
    PlacedDiscs placed = discs.place(progress);
    auto spare = std::make_unique<DiscSets>();
    spare->moving = std::move(placed.moving), spare->openness = std::move(placed.openness);
    release(placed, discs.plans, progress, *spare);
    discs.spare = std::move(spare);
  }
  swap();
  placed_ = true;
  discs.settle_parts();
}

DiscsInPlace::~DiscsInPlace() {
  if (placed_) swap();
}

}  // namespace deltalux::session
