// SPDX-License-Identifier: Apache-2.0
// Rebuilds lists of segments from sample to sample, and finds the crossings in the innermost one.
#include "estimate/sphere_cache/run.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "estimate/crossing.h"

namespace deltalux::estimate::sphere_cache {
namespace {

constexpr size_t kMaxLevels = 10000;
/// Number of segments from which a list's length is representative. Where the limit of rays ends
/// chains, disc tests predicted by 21 pilots were -1.4 to +4.8 % off with this number, -1.6 to +8.4
/// % with 16, and -1.7 to +6.6 % with 24 to 64.
constexpr size_t kTelling = 12;

/// Bound of the rounding errors of tests of segments, relative to the largest coordinates (u =
/// 2^-24): a point where crossing.h accepts a hit lies within 21 u of the segment and of the disc;
/// directions are unit vectors within 32 u, which together with other rounding errors displaces the
/// point nearest to a sphere's centre by up to 66 u; its distance is accurate to 10 u.
constexpr double kMargin = 0x1p-17;

/// Whether the lists' tests are accurate to kMargin.
bool is_usual(Vec3d o, Vec3d w) {
  const double reach = std::max({std::fabs(o.x), std::fabs(o.y), std::fabs(o.z)});
  return std::isfinite(o.x + o.y + o.z) && reach <= kFarthest && std::fabs(dot(w, w) - 1) <= 4e-6;
}

/// The radius of the sphere around `centre` that just contains all segments: smaller than half of
/// the box's diagonal.
double radius_around(const SegmentList& list, Vec3d centre, Progress* progress) {
  double most2 = 0;
  for (size_t i = 0; i < list.size; ++i) {
    if (progress && i % 65536 == 0) progress->check();
    const Vec3d from = Vec3d(list.origin(i)) - centre;
    const double end = list.columns().of[6][i];
    const Vec3d to = from + Vec3d(list.direction(i)) * (end <= kFarthest ? end : 0.0);
    most2 = std::max({most2, dot(from, from), dot(to, to)});
  }
  return std::sqrt(most2);
}

std::vector<double> make_radii(double outer, double ratio, double least, size_t max_levels) {
  std::vector<double> radius{outer};
  while (outer * std::pow(ratio, double(radius.size())) > least) {
    if (max_levels && radius.size() > max_levels) break;
    if (radius.size() > kMaxLevels)
      throw OptionError("sphere_cache: ratio: found " + std::to_string(ratio) +
                        ", which needs over " + std::to_string(kMaxLevels) + " spheres from " +
                        std::to_string(outer) + " m down to discs of " + std::to_string(least) +
                        " m; expected a smaller ratio or larger discs");
    radius.push_back(outer * std::pow(ratio, double(radius.size())));
  }
  return radius;
}

/// All usual segments as a list, with their bounds; `strays` are the others.
struct Gathered {
  SegmentList list;
  std::vector<uint32_t> strays;
  Vec3d low, high;
  double far = 0;  ///< largest coordinate of an origin

  double radius(Progress* progress) const {
    return radius_around(list, (low + high) * 0.5, progress);
  }
};

Gathered gather(const segments::SegmentSpan& s, segments::SegmentEnd rule, float max_radius,
                Progress* progress) {
  Gathered all;
  all.list.reserve(s.count);
  for (size_t i = 0; i < s.count; ++i) {
    if (progress && i % 65536 == 0) progress->check();
    const Vec3f o{s.ox[i], s.oy[i], s.oz[i]}, w{s.dx[i], s.dy[i], s.dz[i]};
    if (!is_usual(Vec3d(o), Vec3d(w))) {
      all.strays.push_back(uint32_t(i));
      continue;
    }
    // The longest part that counts for any disc.
    const float end = segment_end(rule, s.length[i], s.extended[i], max_radius);
    if (all.list.size == 0) all.low = all.high = Vec3d(o);
    const Vec3d to = Vec3d(o) + Vec3d(w) * (double(end) <= kFarthest ? double(end) : 0.0);
    all.low = min(all.low, min(Vec3d(o), to)), all.high = max(all.high, max(Vec3d(o), to));
    for (int axis = 0; axis < 3; ++axis) all.far = std::max(all.far, double(std::fabs(o[axis])));
    all.list.append(o, w, end, uint32_t(i));
  }
  return all;
}

}  // namespace

Root make_root(const segments::SegmentSpan& s, const SphereCacheOptions& options,
               const samples::DiscSet& discs, Progress* progress) {
  const auto [least, most] = std::minmax_element(discs.radius.begin(), discs.radius.end());
  double reach = 0;
  for (size_t k = 0; k < discs.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      reach = std::max(reach, double(std::fabs(discs.centre[k][axis])) + double(discs.radius[k]));
  Gathered all = gather(s, options.rule, *most, progress);
  const double outer = options.outer_radius > 0 ? options.outer_radius : all.radius(progress);
  return {std::move(all.list), std::move(all.strays),
          make_radii(outer, options.ratio, double(*least), options.max_levels),
          kMargin * (reach + all.far)};
}

Run::Run(const samples::DiscSet& discs, const SphereCacheOptions& options, const Root& root,
         const Target& target, const SphereChain& chain)
    : discs_(discs),
      options_(options),
      root_(root),
      target_(target),
      kernels_(kernels(options.lanes)),
      max_radius_(*std::max_element(discs.radius.begin(), discs.radius.end())),
      chain_(chain),
      lists_(root.radius.size()),
      expected_(root.radius.size()),
      scratch_(root.list.size + kRoom) {
  levels.rebuilds.assign(root.radius.size(), 0);
  levels.first_misses.assign(root.radius.size(), 0);
  levels.rays.assign(root.radius.size(), 0);
  levels.tests.assign(root.radius.size(), 0);
  expect(0);
}

void Run::expect(int level) {
  const auto i = size_t(level);
  const size_t count = list(level).count;
  const bool telling = level == 0 || count >= kTelling;
  const double shrink =
      i < options_.shrink.size() ? options_.shrink[i] : options_.ratio * options_.ratio;
  expected_[i] = telling ? double(count) : expected_[i - 1] * shrink;
}

void Run::build_to(int level, bool counted) {
  while (built_ < level && worth_dividing(built_)) {
    const SegmentList& from = list(built_);
    ++built_;
    const size_t i = size_t(built_);
    lists_[i].assign(from, Vec3f(chain_.centre(built_)), root_.radius[i], root_.margin, kernels_,
                     scratch_);
    expect(built_);
    if (!counted) continue;
    stats.sphere_tests += from.count;
    levels.tests[i] += from.count;
    ++levels.rebuilds[i];
    levels.rays[i] += lists_[i].count;
  }
}

void Run::visit(uint32_t disc) {
  const DiscPlace place =
      chain_.place(discs_.centre[disc], discs_.normal[disc], discs_.radius[disc]);
  const int first = chain_.first_to_centre(place, worth_dividing(built_));
  // A run that starts in the middle builds the lists that runs before it have built, without
  // counting.
  build_to(first - 1, false);
  if (first <= place.last) {
    if (first <= chain_.present && built_ >= first - 1 && worth_dividing(first - 1))
      ++levels.first_misses[size_t(first)];
    built_ = std::min(built_, first - 1);
    chain_.centre_on(place, first);
    build_to(place.last, true);
    if (options_.containment != Containment::all) chain_.present = built_;
  }
  if (options_.deposits) deposit(list(std::min(built_, place.last)), disc);
}

void Run::deposit(const SegmentList& list, uint32_t disc) {
  const Vec3f c = discs_.centre[disc], n = discs_.normal[disc];
  const float radius = discs_.radius[disc];
  const size_t count = kernels_.cross_disc(
      list.columns(), list.size, {{c.x, c.y, c.z}, {n.x, n.y, n.z}, radius}, scratch_.data());
  stats.disc_tests += list.count + root_.strays.size();
  const segments::SegmentSpan& s = target_.segments;
  for (size_t k = 0; k < count; ++k)
    __builtin_prefetch(s.power + 3 * size_t(list.columns().index[scratch_[k]]));
  // Ends of segments in the lists are those for the largest disc.
  const bool shorter = options_.rule == segments::SegmentEnd::bounded && radius < max_radius_;
  const bool clipped = discs_.outline[disc] != samples::kWholeDisc;
  if (clipped) stats.outline_tests += count;
  for (size_t k = 0; k < count; ++k) {
    const size_t place = scratch_[k];
    const uint32_t i = list.columns().index[place];
    Vec3f offset;
    if (shorter || clipped || target_.sums.moments) {
      const Crossing crossing = crosses(discs_, disc, list.origin(place), list.direction(place),
                                        s.length[i], s.extended[i], options_.rule);
      if (!crossing.hit) continue;
      offset = crossing.offset;
    }
    stats.disc_tests += place >= list.count;  // so that there are never fewer tests than hits
    add(disc, i, offset);
  }
  for (const uint32_t i : root_.strays) {
    const Crossing crossing =
        crosses(discs_, disc, {s.ox[i], s.oy[i], s.oz[i]}, {s.dx[i], s.dy[i], s.dz[i]}, s.length[i],
                s.extended[i], options_.rule);
    if (crossing.hit) add(disc, i, crossing.offset);
  }
}

void Run::add(uint32_t disc, uint32_t segment, Vec3f offset) {
  const segments::SegmentSpan& s = target_.segments;
  const uint32_t slab = s.slab ? s.slab[segment] : 0;
  const uint32_t* power = s.power + 3 * size_t(segment);
  target_.sums.add(slab, discs_.id[disc], power, target_.sign);
  if (target_.sums.moments)
    add_moments(target_.sums, discs_, disc, offset, slab, power, target_.sign);
  ++stats.hits;
  if (!target_.slots) return;
  HitSlots& slot = target_.slots[segment];
  if (slot.disc[0] == HitSlots::kFree)
    slot.disc[0] = disc;
  else if (slot.disc[1] == HitSlots::kFree)
    slot.disc[1] = disc;
  else
    slot.disc[0] = slot.disc[1] = HitSlots::kMany;
}

}  // namespace deltalux::estimate::sphere_cache

namespace deltalux::estimate {

double enclosing_radius(const segments::SegmentSpan& segments, segments::SegmentEnd rule,
                        float max_radius, Progress* progress) {
  return sphere_cache::gather(segments, rule, max_radius, progress).radius(progress);
}

}  // namespace deltalux::estimate
