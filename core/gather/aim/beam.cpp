// SPDX-License-Identifier: Apache-2.0
// The points that a narrow spot's light lands on, and the probability density with which they are
// drawn.
#include "gather/aim/beam.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"
#include "gather/aim/guide.h"
#include "trace/scatter.h"

namespace deltalux::gather {
namespace {

// versine (1 - cosine) of the half angle of the widest narrow spot: 45 degrees
constexpr float kWidest = 0.3f;
constexpr uint32_t kStride = 8;  // every eighth point along each side represents its neighbours
// share of the power that such a point represents
constexpr float kShareOfPoint = kStride * kStride / float(Beam::kPoints);
// share of the light that counts as if something stood in the beam's way
constexpr float kPerhaps = 0.03f;
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kPi = std::numbers::pi_v<float>;

/// A finite value even where distances vanish. Sampling probabilities need not be accurate, only
/// positive.
float bounded(float x) { return x < 1e20f ? x : 1e20f; }

template <class Visit>
void each_of_few(const Visit& visit) {
  for (uint32_t k = kStride / 2; k < Beam::kSide; k += kStride)
    for (uint32_t i = kStride / 2; i < Beam::kSide; i += kStride) visit(k * Beam::kSide + i);
}

}  // namespace

const char* BeamGuide::flaw(std::span<const trace::Light> lights) const {
  constexpr float kMaxContrast = 1e12f;  // sums of shares stay finite, whatever else is there
  if (light >= lights.size() || !Beam::is_narrow(lights[light])) return "a beam of no narrow spot";
  for (float value : {power, around})
    if (!(value > 0 && std::isfinite(value))) return "a beam's light that is not positive, finite";
  return power / around <= kMaxContrast ? nullptr : "a beam too bright for its surroundings";
}

bool Beam::is_narrow(const trace::Light& light) { return light.concentration <= kWidest; }

Beam::Beam(const trace::Light& light, const BeamGuide& guide, uint32_t number, float beyond,
           uint64_t seed)
    : light_(light.punctual),
      on_(light.on),
      shape_(direct::shape_of(light, guide.light, seed)),
      guide_(guide),
      number_(number),
      beyond_(beyond),
      per_solid_(float(1 / light_.kind->extent(light_))),
      key_(combine(mix64(seed ^ 0x6265616d21212121ull), guide.light)) {}

Vec3f Beam::direction(uint32_t k) const {
  const PathRandom random(key_, k);
  const float u = (float(k % kSide) + random(0, 0)) / kSide;
  const float v = (float(k / kSide) + random(0, 1)) / kSide;
  return light_.kind->start(light_, {u, v, 0, 0}).direction;
}

template <class Caster>
Beam::Point Beam::cast(uint32_t k, const Caster& closest) const {
  // Start at the distance from the lamp at which shadow rays end, since the lamp may lie on a
  // surface.
  const float from = 2 * position_slack(light_.position);
  const Vec3f w = direction(k);
  const trace::Hit hit = on_ ? closest(light_.position, w, from) : trace::Hit{};
  const Vec3f n = hit.valid() ? trace::facing_normal(hit, w) : Vec3f{};
  return is_unit(n) ? Point{light_.position + w * hit.t, n, hit.primitive}
                    : Point{light_.position + w * beyond_, {}, scene::kNone};
}

Beam::Point Beam::cast(const trace::RayCaster& caster, uint32_t k) const {
  return cast(k, [&](Vec3f o, Vec3f w, float from) { return caster.closest(o, w, from); });
}

void Beam::compute(const trace::RayCaster& caster) {
  points_.resize(kPoints);
  for (uint32_t k = 0; k < kPoints; ++k) points_[k] = cast(caster, k);
  find_middle(caster);
}

void Beam::find_middle(const trace::RayCaster& caster) {
  few_.clear(), radiosity_.clear();
  each_of_few([&](uint32_t k) {
    const Point point =
        cast(k, [&](Vec3f o, Vec3f w, float from) { return caster.closest_static(o, w, from); });
    if (point.valid()) few_.push_back(point);
  });
  middle_ = normal_ = {}, extent_ = -1, rise_ = brightest_ = 0;
  if (few_.empty()) return;
  const float each = 1 / float(few_.size());
  for (const Point& point : few_) {
    const direct::Receiver there{point.at, point.normal, scene::kNone, 0, 0};
    radiosity_.push_back(bounded(guide_.power * per_solid_ * float(shape_->open(there))));
    brightest_ = std::max(brightest_, radiosity_.back());
    middle_ = middle_ + point.at * each, normal_ = normal_ + point.normal * each;
  }
  float squared = 0, along = 0;
  for (const Point& point : few_) {
    const Vec3f off = point.at - middle_;
    squared += dot(off, off) * each, along += dot(off, normal_) * dot(off, normal_) * each;
  }
  extent_ = std::sqrt(squared), rise_ = std::sqrt(along);
}

bool Beam::may_reach(Vec3f centre, float radius) const {
  return light_.kind->may_reach(light_, centre, radius);
}

bool Beam::may_reach(const Box& box) const { return light_.kind->may_reach(light_, box); }

bool Beam::update(const trace::RayCaster& caster, const trace::Change& change,
                  std::span<uint8_t> differs) {
  std::vector<Box> met;
  for (const trace::MovedObject& moved : change.objects)
    for (const Box& box : moved.passed)
      if (may_reach(box)) met.push_back(box);
  bool any = false;
  if (met.empty()) return any;
  for (uint32_t k = 0; k < kPoints; ++k) {
    const SlabRay ray(light_.position, direction(k));
    if (std::none_of(met.begin(), met.end(),
                     [&](const Box& box) { return ray.entry(box, kFar) < kFar; }))
      continue;
    const Point now = cast(caster, k);
    if (now == points_[k]) continue;
    points_[k] = now, differs[k] = 1, any = true;
  }
  return any;
}

float Beam::density(const LandedRay& ray, bool& in_beam) const {
  const float cosine = -dot(ray.at.normal, ray.w);
  if (!(cosine > 0) || !is_unit(ray.at.normal)) return 0;
  const direct::LightShape::Glance shadow = shape_->glance(ray.at, 0, 0);
  if (!(shadow.irradiance > 0)) return 0;
  in_beam = true;
  if (ray.caster.occluded(shadow.origin, shadow.direction, shadow.to)) return 0;
  return kPi * per_solid_ * float(shadow.irradiance) * ray.t * ray.t / cosine;
}

float Beam::share(Vec3f from, Vec3f n) const {
  if (!(extent_ >= 0)) return 0;
  const Vec3f d = middle_ - from;
  const float squared = std::max(dot(d, d), extent_ * extent_);
  if (!(squared > 0)) return 0;
  const float distance = std::sqrt(squared);
  const float above = std::clamp(dot(n, d) + extent_, 0.0f, distance);
  const float front = std::clamp(rise_ - dot(normal_, d), 0.0f, distance);
  const float brought = guide_.power * above * front / (kPi * squared * squared);
  return bounded(std::max(brought, kPerhaps * perhaps(from, n)) / guide_.around);
}

float Beam::perhaps(Vec3f from, Vec3f n) const {
  float most = 0;
  if (!(extent_ >= 0)) return most;
  for (const float along : {0.3f, 0.6f, 0.85f}) {
    const Vec3f d = light_.position + (middle_ - light_.position) * along - from;
    const float extent = along * extent_, squared = std::max(dot(d, d), extent * extent);
    const float distance = std::sqrt(squared);
    const float above = std::min(dot(n, d) + extent, distance);
    if (above > 0) most = std::max(most, 0.5f * above / (distance * squared));
  }
  return bounded(guide_.power * most / kPi);
}

Beam::Brought Beam::from_points(Vec3f from, Vec3f n) const {
  Brought out;
  for (size_t i = 0; i < few_.size(); ++i) {
    const Vec3f d = few_[i].at - from;
    const float above = dot(n, d), front = -dot(few_[i].normal, d), squared = dot(d, d);
    if (!(above > 0) || !(front > 0)) continue;
    const float irradiance = std::min(
        radiosity_[i], guide_.power * kShareOfPoint * above * front / (kPi * squared * squared));
    out.irradiance += irradiance, out.square += radiosity_[i] * irradiance;
  }
  out.irradiance = bounded(out.irradiance), out.square = bounded(out.square);
  return out;
}

Expected Beam::expected(Vec3f from, Vec3f n) const {
  const Brought landing = from_points(from, n);
  const float more = kPerhaps * perhaps(from, n);
  return {landing.square + brightest_ * more, landing.irradiance + more, guide_.around};
}

float Beam::beside(Vec3f place) const {
  float sum = 0;
  for (const Point& point : few_) {
    const Vec3f d = point.at - place;
    sum += guide_.power * kShareOfPoint / (kPi * std::max(dot(d, d), extent_ * extent_));
  }
  return bounded(sum / guide_.around);
}

void Beam::look(uint32_t k, const PathRandom& random, VisibilityTest& test, uint32_t& seen) const {
  if (few_.empty()) return;
  const Vec3f from = test.from(), n = test.normal();
  const Point& point = few_[size_t(random(k, 0) * float(few_.size()))];
  if (k % 2) {
    // Test a place on the light's way, where an object might be put.
    const Vec3f d = light_.position + (point.at - light_.position) * random(k, 1) - from;
    seen += dot(d, n) > 0 && !test.caster().occluded_static(from, d, 1);
    return;
  }
  const Vec3f w = point.seen_from(from);
  if (!(dot(w, n) > 0)) return;
  const trace::Hit hit = test.caster().closest_static(from, w);
  seen += hit.valid() && point.is_met(from, w, hit);
}

}  // namespace deltalux::gather
