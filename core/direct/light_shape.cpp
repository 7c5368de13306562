// SPDX-License-Identifier: Apache-2.0
// Strata over a light's surface, and its irradiance in the open.
#include "direct/light_shape.h"

#include <algorithm>
#include <bit>

#include "base/random.h"
#include "direct/form_factor.h"

namespace deltalux::direct {
namespace {

// A triangle this much smaller than its distance (squared) is taken at its centre: 1e-4 off.
constexpr float kSmall = 4e-4f;
// A single ray may stand for an eighth of a light at most.
constexpr float kMostPerRay = 0.125f;

constexpr uint32_t mix32(uint32_t h) {  // finaliser of MurmurHash3
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

uint64_t pair_bits(float a, float b) {
  return uint64_t(std::bit_cast<uint32_t>(a)) << 32 | std::bit_cast<uint32_t>(b);
}

/// Of the receiver's position and normal, never of its index: another sample changes nothing.
uint64_t receiver_key(const Receiver& r) {
  return combine(combine(pair_bits(r.point.x, r.point.y), pair_bits(r.point.z, r.normal.x)),
                 pair_bits(r.normal.y, r.normal.z));
}

/// The most rows that still leave strata about as wide as high with `triangles` of them in line.
uint32_t rows_for(size_t triangles, uint32_t rays, std::initializer_list<uint32_t> divisors) {
  for (uint32_t rows : divisors)
    if (size_t(rows) * rows * triangles <= 2 * size_t(rays)) return rows;
  return 1;
}

/// Lower corners of `count` strata in `rows` rows, column by column.
struct Grid {
  alignas(64) std::array<float, kFineRays> a, b;
  float wide, high;
  Grid(uint32_t count, uint32_t rows) : wide(float(rows) / float(count)), high(1.0f / float(rows)) {
    for (uint32_t i = 0; i < count; ++i) {
      a[i] = float(i / rows) * wide;
      b[i] = float(i % rows) * high;
    }
  }
};

const Grid& grid(Level level, uint32_t rows) {
  static const Grid coarse[] = {
      {kCoarseRays, 1}, {kCoarseRays, 2}, {kCoarseRays, 3}, {kCoarseRays, 6}};
  static const Grid fine[] = {
      {kFineRays, 1}, {kFineRays, 2}, {kFineRays, 4}, {kFineRays, 8}, {kFineRays, 16}};
  if (level == Level::coarse) return coarse[rows == 6 ? 3 : rows - 1];
  return fine[std::countr_zero(rows)];
}

/// Sum in eight lanes, a fixed order that vectorises.
float sum_of(const float* values, size_t count) {
  float lane[8] = {};
  for (size_t i = 0; i + 8 <= count; i += 8)
    for (size_t k = 0; k < 8; ++k) lane[k] += values[i + k];
  for (size_t i = count / 8 * 8; i < count; ++i) lane[i % 8] += values[i];
  return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

}  // namespace

double Strata::share(const trace::RayBits& seen) const {
  if (seen == countable) return 1;
  alignas(64) std::array<float, trace::RayFan::kMost> lit;
  for (size_t i = 0; i < fan.count; ++i) lit[i] = (seen[i / 64] >> (i % 64)) & 1 ? weight[i] : 0.0f;
  const double all = sum_of(weight.data(), fan.count);
  return all > 0 ? double(sum_of(lit.data(), fan.count)) / all : 0.0;
}

LightShape::LightShape(const trace::Light& light, uint32_t number, uint64_t seed, float epsilon)
    : kind_(light.kind),
      two_sided_(light.two_sided),
      on_(light.on),
      key_(combine(mix64(seed), number)),
      epsilon_(epsilon) {
  const bool area = kind_ == scene::LightKind::area;
  const Vec3f power = area ? light.radiance : light.intensity;
  brightest_ = std::max({power.x, power.y, power.z});
  if (!area) {
    punctual_ = light;
    return;
  }
  triangles_.reserve(light.world.size());
  float before = 0;
  for (size_t i = 0; i < light.world.size(); ++i) {
    const trace::LightTriangle& t = light.world[i];
    const Vec3f third = t.edge_v - t.edge_u;
    triangles_.push_back(
        {t.corner, t.edge_u, t.edge_v, t.normal, 0.5f * length(cross(t.edge_u, t.edge_v)),
         std::max({dot(t.edge_u, t.edge_u), dot(t.edge_v, t.edge_v), dot(third, third)}), before,
         light.cumulative[i] - before});
    before = light.cumulative[i];
  }
  rows_[int(Level::coarse)] = rows_for(triangles_.size(), kCoarseRays, {6, 3, 2});
  rows_[int(Level::fine)] = rows_for(triangles_.size(), kFineRays, {16, 8, 4, 2});
}

double LightShape::open(const Receiver& receiver) const {
  if (!on_ || receiver.normal == Vec3f{}) return 0;
  if (kind_ != scene::LightKind::area) return open_punctual(receiver);
  double sum = 0;
  for (const Triangle& triangle : triangles_) sum += open_triangle(triangle, receiver);
  return sum;
}

double LightShape::open_triangle(const Triangle& t, const Receiver& receiver) const {
  const Vec3f to_corner = t.corner - receiver.point;
  const float front = -dot(t.normal, to_corner);
  if (!(front > 0 || (two_sided_ && front < 0))) return 0;
  const Vec3f d = to_corner + (t.edge_u + t.edge_v) * (1.0f / 3.0f);
  const float squared = dot(d, d);
  if (t.longest_squared < kSmall * squared) {
    const float cosines = dot(receiver.normal, d) * std::fabs(front);
    return cosines > 0 ? double(t.area) * cosines / (double(squared) * squared) : 0.0;
  }
  const Vec3d corner(to_corner);
  const Vec3d v[3] = {corner, corner + Vec3d(t.edge_u), corner + Vec3d(t.edge_v)};
  return triangle_irradiance(v, Vec3d(receiver.normal));
}

double LightShape::open_punctual(const Receiver& receiver) const {
  if (kind_ == scene::LightKind::sun)
    return std::max(0.0f, -dot(receiver.normal, punctual_.direction));
  const Vec3f d = punctual_.position - receiver.point;
  const float cosine = dot(receiver.normal, d);
  if (!(cosine > 0)) return 0;
  // Nearer than a shadow ray can tell, a point light shines no brighter.
  const double squared = std::max(double(dot(d, d)), double(epsilon_) * epsilon_);
  const double distance = std::sqrt(squared);
  const double falloff =
      kind_ == scene::LightKind::spot
          ? trace::spot_falloff(punctual_, -dot(punctual_.direction, d) / float(distance))
          : 1.0;
  return falloff * cosine / (squared * distance);
}

void LightShape::cast(const Receiver& receiver, Level level, Strata& out) const {
  out.fan.origin = receiver.point + receiver.normal * epsilon_;
  out.countable = {};
  if (kind_ == scene::LightKind::area)
    cast_area(receiver, level, out);
  else
    cast_single(receiver, out);
}

void LightShape::cast_single(const Receiver& receiver, Strata& out) const {
  out.fan.count = 1;
  out.uneven = false;
  out.weight[0] = open_punctual(receiver) > 0;
  out.countable[0] = out.weight[0] > 0;
  Vec3f d = -punctual_.direction;
  out.fan.to = std::numeric_limits<float>::infinity();
  if (kind_ != scene::LightKind::sun) {
    d = punctual_.position - out.fan.origin;
    // Stops short of the light: it may lie on a surface.
    out.fan.to = std::max(0.0f, 1.0f - 2.0f * epsilon_ / std::max(epsilon_, length(d)));
  }
  out.fan.x[0] = d.x, out.fan.y[0] = d.y, out.fan.z[0] = d.z;
}

const LightShape::Triangle& LightShape::triangle_at(float position) const {
  if (triangles_.size() <= 2)
    return triangles_[triangles_.size() == 2 && position >= triangles_[1].before];
  return *(std::upper_bound(triangles_.begin() + 1, triangles_.end(), position,
                            [](float p, const Triangle& t) { return p < t.before; }) -
           1);
}

void LightShape::cast_area(const Receiver& receiver, Level level, Strata& out) const {
  const size_t count = level == Level::coarse ? kCoarseRays : kFineRays;
  const Grid& strata = grid(level, rows_[int(level)]);
  const uint64_t key = combine(key_, receiver_key(receiver));
  const uint32_t stream = level == Level::coarse ? uint32_t(key) : uint32_t(key >> 32);
  // Separate loops, so that all but the choice of a triangle vectorise.
  alignas(64) float a[kFineRays], b[kFineRays];
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t jitter = mix32(stream + i * 0x9e3779b9u);
    a[i] = strata.a[i] + float(int32_t(jitter >> 16)) * (0x1p-16f * strata.wide);
    b[i] = strata.b[i] + float(int32_t(jitter & 0xffffu)) * (0x1p-16f * strata.high);
  }
  alignas(64) float px[kFineRays], py[kFineRays], pz[kFineRays];
  alignas(64) float nx[kFineRays], ny[kFineRays], nz[kFineRays];
  for (uint32_t i = 0; i < count; ++i) {
    const Triangle& t = triangle_at(a[i]);
    const float along = t.share > 0 ? std::min(1.0f, (a[i] - t.before) / t.share) : 0.5f;
    // Square to triangle by a low-distortion map (Heitz 2019).
    const bool upper = b[i] > along;
    const float u = upper ? 0.5f * along : along - 0.5f * b[i];
    const float v = upper ? b[i] - 0.5f * along : 0.5f * b[i];
    const Vec3f p = t.corner + t.edge_u * u + t.edge_v * v;
    px[i] = p.x, py[i] = p.y, pz[i] = p.z;
    nx[i] = t.normal.x, ny[i] = t.normal.y, nz[i] = t.normal.z;
  }
  const Vec3f from = receiver.point, n = receiver.normal, origin = out.fan.origin;
  for (uint32_t i = 0; i < count; ++i) {
    const float dx = px[i] - from.x, dy = py[i] - from.y, dz = pz[i] - from.z;
    const float facing = nx[i] * dx + ny[i] * dy + nz[i] * dz;  // negative in front of the light
    const float above = n.x * dx + n.y * dy + n.z * dz;
    const float squared = dx * dx + dy * dy + dz * dz;
    const float front = two_sided_ ? std::fabs(facing) : -facing;
    out.weight[i] = above > 0 && front > 0 ? above * front / (squared * squared) : 0.0f;
    // Both ends leave their surface along its normal: a ray that grazes one stays clear of it.
    const float lift = facing > 0 ? -epsilon_ : epsilon_;
    out.fan.x[i] = px[i] + nx[i] * lift - origin.x;
    out.fan.y[i] = py[i] + ny[i] * lift - origin.y;
    out.fan.z[i] = pz[i] + nz[i] * lift - origin.z;
  }
  out.fan.count = count;
  out.fan.to = 1;
  float largest = 0;
  for (uint32_t i = 0; i < count; ++i) {
    largest = std::max(largest, out.weight[i]);
    out.countable[i / 64] |= uint64_t(out.weight[i] > 0) << (i % 64);
  }
  const float all = sum_of(out.weight.data(), count);
  out.uneven = level == Level::coarse && !(largest < kMostPerRay * all);
}

}  // namespace deltalux::direct
