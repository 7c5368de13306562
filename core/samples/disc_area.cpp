// SPDX-License-Identifier: Apache-2.0
// Probes discs in their plane: outlines (constant) and covered area (of the present state).
#include "samples/disc_area.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/assertion.h"

namespace deltalux::samples {
namespace {

constexpr float kStep = 2 * std::numbers::pi_v<float> / kProbes;
// Clipped outlines end slightly before the clipping geometry, so that rounding does not carry them
// through.
constexpr float kShort = 0.998f;
// Size of a polygon with kProbes corners around the circle, relative to the radius.
const float kAround = 1.0f / std::cos(0.5f * kStep);
// Probes extend beyond the circle, to detect geometry that may jut in between two of them.
constexpr float kGuard = 1.25f;

/// Whether estimators can work with all discs: columns of equal lengths, places and radii finite,
/// normals of unit length, outlines within their circles.
bool are_sound(const DiscSet& discs) {
  const size_t n = discs.size();
  bool sound = discs.normal.size() == n && discs.radius.size() == n && discs.outline.size() == n &&
               discs.id.size() == n;
  for (size_t i = 0; sound && i < n; ++i) {
    const Vec3f c = discs.centre[i], normal = discs.normal[i];
    sound = std::isfinite(c.x + c.y + c.z + discs.radius[i]) && discs.radius[i] >= 0 &&
            std::fabs(dot(normal, normal) - 1) < 1e-3f &&
            (discs.outline[i] == kWholeDisc || discs.outline[i] < discs.outlines.size());
    for (int k = 0; sound && discs.outline[i] != kWholeDisc && k < kProbes; ++k) {
      const float end = discs.outlines[discs.outline[i]][size_t(k)];
      sound = end >= 0 && end <= discs.radius[i];
    }
  }
  return sound;
}

/// Directions of the probes.
struct Compass {
  float cosine[kProbes], sine[kProbes];
  Compass() {
    for (int k = 0; k < kProbes; ++k) {
      cosine[k] = std::cos(kStep * float(k));
      sine[k] = std::sin(kStep * float(k));
    }
  }
};

Vec3f probe_direction(Vec3f u, Vec3f v, int k) {
  static const Compass compass;
  return u * compass.cosine[k] + v * compass.sine[k];
}

/// Area of sector k of an outline whose neighbouring probes have lengths a and b.
float sector_area(float a, float b, float radius) {
  return a >= radius && b >= radius ? 0.5f * kStep * radius * radius
                                    : 0.5f * a * b * std::sin(kStep);
}

/// The share of a probe [0, reach], weighted by the distance from the centre, that foreign geometry
/// covers: everything beyond the first static hit, and the intervals inside closed movable objects.
float covered_share(const ForeignGeometry& foreign, Vec3f centre, Vec3f along, float reach) {
  thread_local std::vector<trace::Stretch> covered;
  covered.clear();
  if (foreign.with_static) {
    const float hit = foreign.caster->closest_static(centre, along, 0, reach).t;
    if (hit < reach) covered.push_back({hit, reach});
  }
  for (uint32_t object : foreign.caster->present())
    if (object != foreign.own_object)
      foreign.caster->add_inside(object, centre, along, reach, covered);
  std::sort(covered.begin(), covered.end(),
            [](const auto& a, const auto& b) { return a.begin < b.begin; });
  float sum = 0, done = 0;
  for (const trace::Stretch& piece : covered) {
    const float begin = std::max(done, piece.begin);
    if (piece.end > begin) sum += piece.end * piece.end - begin * begin;
    done = std::max(done, piece.end);
  }
  return std::min(1.0f, sum / (reach * reach));
}

/// How far a disc's centre sees along each probe.
class Probes {
 public:
  Probes(const Ground& ground, Vec3f centre, Vec3f normal, float radius)
      : caster_(ground.caster), centre_(centre), far_(kAround * radius) {
    Vec3f u, v;
    tangent_frame(normal, u, v);
    for (int k = 0; k < kProbes; ++k) {
      along_[k] = probe_direction(u, v, k);
      hit_[k] = caster_.closest_static(centre, along_[k], 0.0f, kGuard * radius);
      const float t = std::min(hit_[k].t, distance_to_border(ground.world, centre, along_[k]));
      reach_[k] = t < far_ ? kShort * t : far_;
    }
    for (int k = 0; k < kProbes; ++k) clear_sector(k);
  }

  Outline outline(float radius) const {
    Outline out;
    for (int k = 0; k < kProbes; ++k)
      out[k] = reach_[k] >= far_ ? radius : std::min(reach_[k], kShort * radius);
    return out;
  }

 private:
  Vec3f at(int k, float distance) const { return centre_ + along_[k] * distance; }

  bool sees(int k, int next, float a, float b) const {
    const Vec3f from = at(k, a);
    return !caster_.occluded_static(from, at(next, b) - from, 1.0f);
  }

  /// Nothing as wide as a room fits between two probes that extend beyond the circle, nor between
  /// two that end on one plane.
  bool surely_free(int k, int next) const {
    if (!hit_[k].valid() && !hit_[next].valid()) return true;
    if (!hit_[k].valid() || !hit_[next].valid()) return false;
    const Vec3f n = hit_[k].normal, along = at(next, hit_[next].t) - at(k, hit_[k].t);
    return std::fabs(dot(n, along)) <= 1e-3f * length(n) * length(along);
  }

  /// Geometry may jut in between two probes; where walls are thin, a corner of the next room. The
  /// triangle of a sector is free if its third side is. Shortens the two probes until that holds;
  /// this keeps other sectors free.
  void clear_sector(int k) {
    const int next = (k + 1) % kProbes;
    float &a = reach_[k], &b = reach_[next];
    if (surely_free(k, next) || sees(k, next, a, b)) return;
    constexpr int kSteps = 5;
    const float full_a = a, full_b = b, shorter = std::min(a, b);
    // Shorten only the longer probe if that suffices, otherwise both.
    const bool alone = sees(k, next, shorter, shorter);
    float good = alone ? shorter : 0.0f, bad = alone ? std::max(a, b) : shorter;
    for (int step = 0; step < kSteps; ++step) {
      const float middle = 0.5f * (good + bad);
      (sees(k, next, std::min(full_a, middle), std::min(full_b, middle)) ? good : bad) = middle;
    }
    a = std::min(full_a, good), b = std::min(full_b, good);
  }

  const trace::RayCaster& caster_;
  Vec3f centre_;
  float far_;
  std::array<Vec3f, kProbes> along_;
  std::array<trace::Hit, kProbes> hit_;
  Outline reach_;
};

}  // namespace

float slack_under(const Ground& ground, Vec3f point, Vec3f normal, float within) {
  const Vec3f above = point + normal * within;
  const trace::Hit hit = ground.caster.closest_static(above, -normal, 0.0f, 2 * within);
  return hit.valid() ? ground.scene.slack_of(ground.first_primitive + hit.primitive) : 0.0f;
}

float rounding_above(const Ground& ground, Vec3f point, Vec3f normal, float within) {
  return position_slack(point) + slack_under(ground, point, normal, within);
}

DiscSet make_discs(const SampleSet& samples, std::vector<uint32_t> ids, DiscArea rule,
                   const Ground& ground, const Workers& workers, Progress& progress) {
  constexpr float kMinLift = 2;     // in units of the rounding error
  constexpr float kGround = 0.01f;  // radii: a surface under a sample is at most this far away
  DiscSet discs;
  const size_t n = ids.size();
  discs.centre.resize(n);
  discs.normal.resize(n);
  discs.radius.resize(n);
  discs.outline.assign(n, kWholeDisc);
  discs.id = std::move(ids);
  progress.begin("discs", n);
  constexpr size_t kBlock = 64;  // takes a few milliseconds between two checks for cancellation
  std::vector<std::vector<Outline>> found((n + kBlock - 1) / kBlock);
  workers.for_blocks(n, kBlock, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i) {
      const uint32_t id = discs.id[i];
      const Vec3f normal = samples.normal[id];
      const float radius = samples.radius[id];
      const float rounding = rounding_above(ground, samples.point[id], normal, kGround * radius);
      const float lift = rule == DiscArea::reachable ? std::max(kMinLift * rounding, kLift * radius)
                                                     : kMinLift * rounding;
      discs.normal[i] = normal;
      discs.radius[i] = radius;
      // If there is a ceiling lower than that, keep the disc below it.
      const Vec3f above = samples.point[id] + normal * (0.5f * rounding);
      const float room = ground.caster.closest_static(above, normal, 0.0f, 2 * lift).t;
      discs.centre[i] = samples.point[id] + normal * std::min(lift, 0.5f * room);
      if (rule == DiscArea::whole) continue;
      const Outline outline = Probes(ground, discs.centre[i], normal, radius).outline(radius);
      if (std::all_of(outline.begin(), outline.end(), [&](float r) { return r >= radius; }))
        continue;
      discs.outline[i] = uint32_t(found[begin / kBlock].size());
      found[begin / kBlock].push_back(outline);
    }
    progress.advance(end - begin);
  });
  for (size_t block = 0; block < found.size(); ++block) {
    const uint32_t base = uint32_t(discs.outlines.size());
    for (size_t i = block * kBlock; i < std::min(n, (block + 1) * kBlock); ++i)
      if (discs.outline[i] != kWholeDisc) discs.outline[i] += base;
    discs.outlines.insert(discs.outlines.end(), found[block].begin(), found[block].end());
  }
  DELTALUX_ASSERT(are_sound(discs));
  return discs;
}

DiscPoints::DiscPoints(Vec3f normal, float radius, const Outline& outline) {
  Vec3f u, v;
  tangent_frame(normal, u, v);
  float sum = 0;
  for (int k = 0; k < kProbes; ++k) {
    end_[k] = probe_direction(u, v, k) * outline[k];
    area_[k] = sum += sector_area(outline[k], outline[(k + 1) % kProbes], radius);
  }
}

Vec3f DiscPoints::operator()(float sector, float outward, float across) const {
  const auto found = std::lower_bound(area_.begin(), area_.end() - 1, sector * area_.back());
  const size_t k = size_t(found - area_.begin());
  const Vec3f rim = end_[k] * (1 - across) + end_[(k + 1) % kProbes] * across;
  return rim * std::sqrt(outward);
}

float outline_area(const DiscSet& discs, size_t i) {
  const float radius = discs.radius[i];
  if (discs.outline[i] == kWholeDisc) return std::numbers::pi_v<float> * radius * radius;
  const Outline& outline = discs.outlines[discs.outline[i]];
  float area = 0;
  for (int k = 0; k < kProbes; ++k)
    area += sector_area(outline[k], outline[(k + 1) % kProbes], radius);
  return area;
}

OutlineMoments outline_moments(const DiscSet& discs, size_t i) {
  OutlineMoments m;
  const float radius = discs.radius[i];
  const bool whole = discs.outline[i] == kWholeDisc;
  for (int k = 0; k < kProbes; ++k) {
    const int next = (k + 1) % kProbes;
    const float a = whole ? radius : discs.outlines[discs.outline[i]][k];
    const float b = whole ? radius : discs.outlines[discs.outline[i]][next];
    // Treat a sector of the circle as a triangle of the same area.
    const double area = sector_area(a, b, radius);
    const double chord = 0.5 * a * b * std::sin(kStep);
    const double scale = chord > 0 ? std::sqrt(area / chord) : 0;
    const double au = scale * a * std::cos(kStep * float(k)),
                 av = scale * a * std::sin(kStep * float(k));
    const double bu = scale * b * std::cos(kStep * float(next)),
                 bv = scale * b * std::sin(kStep * float(next));
    m.area += area;
    m.u += area * (au + bu) / 3;
    m.v += area * (av + bv) / 3;
    m.uu += area / 12 * (au * au + bu * bu + (au + bu) * (au + bu));
    m.vv += area / 12 * (av * av + bv * bv + (av + bv) * (av + bv));
    m.uv += area / 12 * (au * av + bu * bv + (au + bu) * (av + bv));
  }
  return m;
}

float uncovered_area(const DiscSet& discs, size_t i, const Pose& pose,
                     const ForeignGeometry& foreign) {
  const float radius = discs.radius[i];
  const bool whole = discs.outline[i] == kWholeDisc;
  Vec3f u, v;
  tangent_frame(discs.normal[i], u, v);
  const Vec3f centre = pose.point(discs.centre[i]);
  float reach[kProbes], open[kProbes];
  const auto probe = [&](int k) {
    reach[k] = whole ? radius : discs.outlines[discs.outline[i]][k];
    const Vec3f along = pose.direction(probe_direction(u, v, k));
    open[k] = reach[k] > 0 ? 1.0f - covered_share(foreign, centre, along, reach[k]) : 1.0f;
    return open[k] < 1.0f;
  };
  // Most discs near a movable are not covered: test with a few probes first.
  constexpr int kCoarse = 4;
  bool covered = false;
  for (int k = 0; k < kProbes; k += kCoarse) covered |= probe(k);
  if (!covered) return outline_area(discs, i);
  for (int k = 0; k < kProbes; ++k)
    if (k % kCoarse) probe(k);
  float area = 0;
  for (int k = 0; k < kProbes; ++k) {
    const int next = (k + 1) % kProbes;
    area += sector_area(reach[k], reach[next], radius) * 0.5f * (open[k] + open[next]);
  }
  return area;
}

}  // namespace deltalux::samples
