// SPDX-License-Identifier: Apache-2.0
// Shadow rays to strata of a light's surface, and the light's unshadowed irradiance.
#include "direct/area_shape.h"

#include <algorithm>
#include <bit>

#include "base/random.h"
#include "direct/form_factor.h"
#include "direct/lane_sum.h"

namespace deltalux::direct {
namespace {

// A triangle whose squared size is below this multiple of its squared distance is treated as a
// point: relative error 1e-4.
constexpr float kSmall = 4e-4f;
// 36 rays are too few where one of them represents more than an eighth of the light, or where the
// light is large (irradiance over radiance; pi for the whole sky): light through a gap between rays
// could be as bright as the rest of the room.
constexpr float kMaxPerRay = 0.125f, kLarge = 0.3f;
// Keep points away from the borders of their strata, in their widths: another surface may adjoin
// the light's border.
constexpr float kMaxJitter = 0x1ffffp-17f;
constexpr float kFlat = 0.999999f;  // cosine: normals of one plane differ by less
// in radii of the light: at a larger distance, shadows of it have almost no penumbra
constexpr float kTiny = 16.0f;
// of the reference, see the constructor
constexpr double kFaint = 1e-4, kMinor = 1e-2, kMajor = 0.2;
// in radii of the light: at a smaller distance, its points contribute very differently
constexpr float kClose = 3.0f;

constexpr uint32_t mix32(uint32_t h) {  // finaliser of MurmurHash3
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

/// The largest number of rows for which strata are still about as wide as high, with `triangles` of
/// them side by side.
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

const Grid& grid(Detail detail, uint32_t rows) {
  static const Grid coarse[] = {
      {kCoarseRays, 1}, {kCoarseRays, 2}, {kCoarseRays, 3}, {kCoarseRays, 6}};
  static const Grid fine[] = {
      {kFineRays, 1}, {kFineRays, 2}, {kFineRays, 4}, {kFineRays, 8}, {kFineRays, 16}};
  if (detail == Detail::coarse) return coarse[rows == 6 ? 3 : rows - 1];
  return fine[std::countr_zero(rows)];
}

/// How far in front of the light's surface a shadow ray ends that comes `d` along; `slack` is of
/// the place.
inline float lift(float slack, Vec3f d) { return std::max(slack, position_slack(d)); }

}  // namespace

AreaShape::AreaShape(const trace::Light& light, uint32_t number, uint64_t seed, double reference)
    : LightShape(light, number, seed),
      centre_(light.bounds.centre()),
      radius_(0.5f * light.bounds.diagonal()),
      two_sided_(light.two_sided),
      varies_(light.brightest_part != 1),
      area_(float(light.area)) {
  if (const double brightest = this->brightest(); brightest > 0)
    faint_ = kFaint * reference / brightest, minor_ = kMinor * reference / brightest,
    major_ = kMajor * reference / brightest;
  triangles_.reserve(light.world.size());
  float before = 0;
  for (size_t i = 0; i < light.world.size(); ++i) {
    const trace::LightTriangle& t = light.world[i];
    triangles_.push_back({t.corner, t.edge_u, t.edge_v, t.normal, t.slack, t.brightness, before,
                          light.cumulative[i] - before});
    columns_.add(triangles_.back());
    before = light.cumulative[i];
  }
  const std::vector<float>& starts = columns_.before;
  for (size_t i = 0, found = 0; i < starts.size(); ++i) {
    const float position = float(i) / float(starts.size());
    while (found + 1 < starts.size() && starts[found + 1] <= position) ++found;
    nearby_.push_back(uint32_t(found));
  }
  facing_ = triangles_.front().normal;
  for (const Triangle& t : triangles_)
    if (!(dot(t.normal, facing_) > kFlat)) facing_ = {};
  find_corners(centre_);
  find_outline(light.bounds);
  rows_[0] = rows_for(triangles_.size(), kCoarseRays, {6, 3, 2});
  rows_[1] = rows_for(triangles_.size(), kFineRays, {16, 8, 4, 2});
}

void AreaShape::find_corners(Vec3f centre) {
  // Choose vertices greedily, each the farthest from those chosen before. Draw each a little into
  // its triangle, away from a frame that may touch the light.
  constexpr float kInset = 0.02f;
  const auto vertex = [&](size_t i) {
    const Triangle& t = triangles_[i / 3];
    return i % 3 == 0 ? t.corner : t.corner + (i % 3 == 1 ? t.edge_u : t.edge_v);
  };
  std::vector<float> distance(3 * triangles_.size());
  const auto squared = [&](size_t i, Vec3f p) { return dot(vertex(i) - p, vertex(i) - p); };
  for (size_t i = 0; i < distance.size(); ++i) distance[i] = squared(i, centre);
  for (Corner& corner : corners_) {
    const size_t chosen =
        size_t(std::max_element(distance.begin(), distance.end()) - distance.begin());
    const Triangle& t = triangles_[chosen / 3];
    const Vec3f tip = vertex(chosen), middle = t.corner + (t.edge_u + t.edge_v) * (1.0f / 3.0f);
    corner = {tip + (middle - tip) * kInset, t.normal, t.slack};
    for (size_t i = 0; i < distance.size(); ++i) {
      const float d = squared(i, tip);
      distance[i] = &corner == corners_.data() ? d : std::min(distance[i], d);
    }
  }
}

void AreaShape::find_outline(const Box& bounds) {
  constexpr size_t kFew = 4;
  if (triangles_.size() <= kFew) {
    for (const Triangle& t : triangles_)
      outline_.insert(outline_.end(), {t.corner, t.corner + t.edge_u, t.corner + t.edge_v});
    return;
  }
  for (int k = 0; k < 8; ++k)
    outline_.push_back({k & 1 ? bounds.low.x : bounds.high.x, k & 2 ? bounds.low.y : bounds.high.y,
                        k & 4 ? bounds.low.z : bounds.high.z});
}

void AreaShape::Columns::add(const Triangle& t) {
  const Vec3f middle = (t.edge_u + t.edge_v) * (1.0f / 3.0f);
  x.push_back(t.corner.x), y.push_back(t.corner.y), z.push_back(t.corner.z);
  middle_x.push_back(middle.x), middle_y.push_back(middle.y), middle_z.push_back(middle.z);
  normal_x.push_back(t.normal.x), normal_y.push_back(t.normal.y), normal_z.push_back(t.normal.z);
  power.push_back(0.5f * length(cross(t.edge_u, t.edge_v)) * t.brightness);
  const Vec3f third = t.edge_v - t.edge_u;
  longest_squared.push_back(
      std::max({dot(t.edge_u, t.edge_u), dot(t.edge_v, t.edge_v), dot(third, third)}));
  before.push_back(t.before);
}

double AreaShape::full(const Receiver& receiver) const {
  constexpr size_t kBlock = 64;
  const Vec3f p = receiver.point, n = receiver.normal;
  const Columns& c = columns_;
  const float behind = two_sided_ ? 1.0f : 0.0f;
  alignas(64) double as_point[kBlock];
  alignas(64) float facing[kBlock];  // > 0: to be integrated exactly
  double sum = 0;
  for (size_t first = 0; first < triangles_.size(); first += kBlock) {
    const size_t count = std::min(kBlock, triangles_.size() - first);
    for (size_t k = 0; k < count; ++k) {
      const size_t i = first + k;
      const Vec3f to{c.x[i] - p.x, c.y[i] - p.y, c.z[i] - p.z};
      const float side = -dot(Vec3f{c.normal_x[i], c.normal_y[i], c.normal_z[i]}, to);
      const float front = std::max(side, -side * behind);
      const Vec3f d{to.x + c.middle_x[i], to.y + c.middle_y[i], to.z + c.middle_z[i]};
      const float squared = dot(d, d), above = dot(n, d) * front;
      const bool small = c.longest_squared[i] < kSmall * squared;
      const float cosines = small & (front > 0) & (above > 0) ? above : 0.0f;
      as_point[k] = cosines > 0
                        ? double(c.power[i]) * double(cosines) / (double(squared) * double(squared))
                        : 0.0;
      facing[k] = small ? 0.0f : front;
    }
    for (size_t k = 0; k < count; ++k) {
      if (!(facing[k] > 0)) {
        sum += as_point[k];
        continue;
      }
      const Triangle& t = triangles_[first + k];
      const Vec3d corner(t.corner - p);
      const Vec3d v[3] = {corner, corner + Vec3d(t.edge_u), corner + Vec3d(t.edge_v)};
      sum += triangle_irradiance(v, Vec3d(n)) * double(t.brightness);
    }
  }
  return sum;
}

double AreaShape::rough(const Receiver& receiver) const {
  const Vec3f d = centre_ - receiver.point;
  const float squared = std::max(dot(d, d), radius_ * radius_), distance = std::sqrt(squared);
  const float above = std::min(dot(receiver.normal, d) + radius_, distance);
  if (!(above > 0)) return 0;
  float front = 0.5f * distance;
  if (!(facing_ == Vec3f{})) {
    // Do not treat a light as facing away because of rounding errors.
    const float side = -dot(facing_, d), least = 2e-3f * distance;
    front = two_sided_ ? std::max(std::fabs(side), least) : side + least;
    if (!(front > 0)) return 0;
  }
  return double(area_) * double(above) * double(front) / (double(squared) * double(squared));
}

bool AreaShape::may_reach(const Box& points) const {
  if (two_sided_ || facing_ == Vec3f{}) return true;
  // As in rough(), with the double of its margin.
  float highest = -kFarthest, farthest = radius_;
  for (int k = 0; k < 8; ++k) {
    const Vec3f corner{k & 1 ? points.low.x : points.high.x, k & 2 ? points.low.y : points.high.y,
                       k & 4 ? points.low.z : points.high.z};
    const Vec3f d = centre_ - corner;
    highest = std::max(highest, -dot(facing_, d));
    farthest = std::max(farthest, length(d) + position_slack(corner));
  }
  return highest + 4e-3f * farthest > 0;
}

bool AreaShape::is_minor(const Receiver& receiver) const {
  return minor_ > 0 && about(receiver) < minor_;
}

bool AreaShape::is_small(const Receiver& receiver) const {
  const Vec3f d = centre_ - receiver.point;
  return dot(d, d) > kClose * kClose * radius_ * radius_;
}

AreaShape::Glance AreaShape::glance(const Receiver& receiver, float u, float v) const {
  Strata one;
  one.fan.origin = origin(receiver);
  one.fan.to = 1;
  cast_triangle(receiver, triangle_at(u), &u, &v, 0, 1, one);
  return {one.fan.origin,
          {one.fan.x[0], one.fan.y[0], one.fan.z[0]},
          one.fan.to,
          double(area_) * double(one.weight[0])};
}

double AreaShape::by_strata(const Strata& rays) const {
  const size_t count = std::min<size_t>(rays.fan.count, kCoarseRays);
  return double(area_) * double(lane_sum(rays.weight.data(), count)) / double(count);
}

const AreaShape::Triangle& AreaShape::triangle_at(float position) const {
  // Guided search (Chen & Asau 1974): a bulb has thousands of triangles, and bisection would wait
  // for memory at each step.
  const std::vector<float>& before = columns_.before;
  const size_t count = before.size();
  size_t i = nearby_[std::min(size_t(std::max(position, 0.0f) * float(count)), count - 1)];
  while (i > 0 && position < before[i]) --i;
  while (i + 1 < count && before[i + 1] <= position) ++i;
  return triangles_[i];
}

/// Lower corners of strata, ascending within each triangle, and their size.
struct AreaShape::Places {
  const float *a, *b;
  size_t count;
  float wide, high;
};

void AreaShape::cast_points(const Receiver& receiver, const Places& places, const float* a,
                            const float* b, Strata& out) const {
  const size_t count = places.count;
  // Process strata that lie on one triangle together, which can be vectorised; the others one by
  // one.
  for (size_t i = 0; i < count;) {
    const Triangle& t = triangle_at(places.a[i]);
    const auto on_triangle = [&](float low) {
      return low >= t.before && low + kMaxJitter * places.wide < t.before + t.share;
    };
    size_t end = i;
    while (end < count && on_triangle(places.a[end])) ++end;
    if (end > i) {
      cast_triangle(receiver, t, a, b, i, end, out);
      i = end;
    } else {
      cast_triangle(receiver, triangle_at(a[i]), a, b, i, i + 1, out);
      ++i;
    }
  }
}

void AreaShape::cast_places(const Receiver& receiver, const Places& places, uint32_t stream,
                            Strata& out) const {
  alignas(64) float a[kFineRays], b[kFineRays];
  const size_t count = places.count;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t jitter = mix32(stream + i * 0x9e3779b9u);
    a[i] = places.a[i] + (float(int32_t(jitter >> 16)) + 0.5f) * (0x1p-16f * places.wide);
    b[i] = places.b[i] + (float(int32_t(jitter & 0xffffu)) + 0.5f) * (0x1p-16f * places.high);
  }
  cast_points(receiver, places, a, b, out);
  out.fan.count = count;
  out.fan.to = 1;
  std::fill(out.weight.begin() + count, out.weight.begin() + (count + 3) / 4 * 4, 0.0f);
  for (size_t i = 0; i < count; i += 4) {
    uint64_t bits = 0;
    for (size_t k = 0; k < 4; ++k) bits |= uint64_t(out.weight[i + k] > 0) << k;
    out.countable[i / 64] |= bits << (i % 64);
  }
}

void AreaShape::smooth(const Receiver& receiver, const Places& places, Strata& out) const {
  constexpr size_t kPoints = 4;
  alignas(64) float a[kFineRays] = {}, b[kFineRays] = {}, sum[kFineRays] = {};
  Strata other;
  other.fan.origin = out.fan.origin;
  trace::RayBits whole = out.countable, &some = out.nearly = out.countable;
  for (size_t point = 0; point < kPoints; ++point) {
    for (size_t i = 0; i < places.count; ++i) {
      a[i] = places.a[i] + places.wide * (point & 1 ? 0.75f : 0.25f);
      b[i] = places.b[i] + places.high * (point & 2 ? 0.75f : 0.25f);
    }
    cast_points(receiver, places, a, b, other);
    for (size_t i = 0; i < places.count; ++i) {
      const uint64_t counts = other.weight[i] > 0, place = i % 64;
      sum[i] += other.weight[i];
      whole[i / 64] &= ~(uint64_t(1) << place) | counts << place;
      some[i / 64] |= counts << place;
    }
  }
  for (size_t i = 0; i < places.count; ++i)
    if (whole[i / 64] >> (i % 64) & 1) out.weight[i] = sum[i] / kPoints;
}

void AreaShape::cast(const Receiver& receiver, Detail detail, Strata& out) const {
  out.fan.origin = origin(receiver);
  out.countable = {};
  if (detail == Detail::fine && is_minor(receiver)) detail = Detail::middle;
  const bool few = detail != Detail::fine;
  const size_t count = few ? kCoarseRays : kFineRays;
  const uint32_t rows = rows_[few ? 0 : 1];
  const Grid& strata = grid(few ? Detail::coarse : Detail::fine, rows);
  const uint64_t bits = key(receiver);
  const uint32_t stream = few ? uint32_t(bits) : uint32_t(bits >> 32);
  cast_places(receiver, {strata.a.data(), strata.b.data(), count, strata.wide, strata.high}, stream,
              out);
  out.rows = rows;
  out.too_coarse = false;
  if (detail != Detail::coarse) return;
  const float all = lane_sum(out.weight.data(), count);
  const float largest = *std::max_element(out.weight.begin(), out.weight.begin() + count);
  out.too_coarse = !(largest < kMaxPerRay * all) || all * area_ > kLarge * float(count);
  cast_corners(receiver, out);
  thin(receiver, out);
}

void AreaShape::thin(const Receiver& receiver, Strata& out) const {
  const Vec3f d = centre_ - receiver.point;
  const bool faint = minor_ > 0 && about(receiver) < faint_;
  if (!is_minor(receiver) && !(dot(d, d) > kTiny * kTiny * radius_ * radius_)) return;
  // Another third for each place and light, so that the choice has no bias.
  const auto third = uint32_t(key(receiver) % 3);
  uint64_t some = out.countable[0] & (few_rays(third) | kCornerBits);
  if (faint) {
    out.too_coarse = false;
    // whichever of the rays comes first from a place that depends on the receiver
    const uint64_t turn = place_key(receiver.point, receiver.normal) % kCoarseRays;
    const uint64_t rays = out.countable[0] & kCoarseBits, after = rays >> turn << turn;
    some = after ? after : rays;
    some &= ~some + 1;
  }
  if (some) out.countable[0] = some;
}

void AreaShape::divide(const Receiver& receiver, const Cells& cells, Strata& out) const {
  const uint32_t finer = cells.depth ? kParts : 1, rows = rows_[1] * finer;
  const float cell_high = 1.0f / float(rows);
  const float cell_wide = float(rows) / float(kFineRays * finer * finer);
  const float wide = cell_wide / float(cells.parts), high = cell_high / float(cells.parts);
  alignas(64) float a[kFineRays], b[kFineRays];
  size_t count = 0;
  for (const uint32_t cell : cells.numbers) {
    const float left = float(cell / rows) * cell_wide, low = float(cell % rows) * cell_high;
    for (uint32_t k = 0; k < cells.parts * cells.parts; ++k, ++count) {
      a[count] = left + float(k / cells.parts) * wide;
      b[count] = low + float(k % cells.parts) * high;
    }
  }
  out.fan.origin = origin(receiver);
  out.countable = {};
  const uint64_t kind = uint64_t(cells.depth * kParts + cells.parts) << 32;
  const auto stream = uint32_t(combine(key(receiver), kind | cells.numbers.front()));
  const Places places{a, b, count, wide, high};
  cast_places(receiver, places, stream, out);
  smooth(receiver, places, out);
}

void AreaShape::cast_corners(const Receiver& receiver, Strata& out) const {
  for (const Corner& corner : corners_) {
    const size_t i = out.fan.count++;
    const Vec3f d = corner.point - receiver.point;
    const float facing = -dot(corner.normal, d);
    const Vec3f ray =
        corner.point - out.fan.origin +
        corner.normal * std::copysign(lift(corner.slack, d), two_sided_ ? facing : 1.0f);
    out.weight[i] = 0;
    out.fan.x[i] = ray.x, out.fan.y[i] = ray.y, out.fan.z[i] = ray.z;
    const bool counts = dot(receiver.normal, d) > 0 && (two_sided_ || facing > 0);
    out.countable[0] |= uint64_t(counts) << i;
  }
}

void AreaShape::cast_triangle(const Receiver& receiver, Triangle t, const float* __restrict a,
                              const float* __restrict b, size_t begin, size_t end,
                              Strata& out) const {
  const Vec3f from = t.corner - receiver.point, n = receiver.normal;
  const Vec3f lifted = t.corner - out.fan.origin;
  const float stretch = t.share > 0 ? 1 / t.share : 0.0f, behind = two_sided_ ? 1.0f : 0.0f;
  const float slack = t.slack;
  float* const __restrict weight = out.weight.data();
  float* const __restrict x = out.fan.x.data();
  float* const __restrict y = out.fan.y.data();
  float* const __restrict z = out.fan.z.data();
  for (size_t i = begin; i < end; ++i) {
    // Map the square to the triangle with low distortion (Heitz 2019).
    const float inside = (a[i] - t.before) * stretch;
    const float along = inside < 1 ? inside : 1.0f;
    const float half = 0.5f * (along < b[i] ? along : b[i]);
    const float u = along - half, v = b[i] - half;
    const float px = t.edge_u.x * u + t.edge_v.x * v;
    const float py = t.edge_u.y * u + t.edge_v.y * v;
    const float pz = t.edge_u.z * u + t.edge_v.z * v;
    const float dx = from.x + px, dy = from.y + py, dz = from.z + pz;
    const float facing = -(t.normal.x * dx + t.normal.y * dy + t.normal.z * dz);
    const float above = n.x * dx + n.y * dy + n.z * dz;
    const float other = -facing * behind;
    const float front = facing > other ? facing : other;
    const float squared = dx * dx + dy * dy + dz * dz;
    const float cosines = (above > 0 ? above : 0.0f) * front;
    weight[i] = cosines / (squared * squared + std::numeric_limits<float>::min());
    // Offset both ends of the ray along their surfaces' normals, so that a grazing ray does not hit
    // the surfaces themselves.
    const float off = std::copysign(lift(slack, {dx, dy, dz}), facing * behind + (1 - behind));
    x[i] = lifted.x + px + t.normal.x * off;
    y[i] = lifted.y + py + t.normal.y * off;
    z[i] = lifted.z + pz + t.normal.z * off;
  }
}

}  // namespace deltalux::direct
