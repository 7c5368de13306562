// SPDX-License-Identifier: Apache-2.0
// Finds lights, divides paths among them, and samples their emission.
#include "trace/lights.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>

#include "base/cone.h"
#include "base/curve_order.h"
#include "base/error.h"
#include "base/polygon.h"
#include "trace/glow.h"

namespace deltalux::trace {
namespace {

constexpr double kPi = std::numbers::pi;
// Of an object in more pieces than kFewPieces, those that lie close together are one light: within
// kTogether times the diagonal of the largest of them, as the keys of a keyboard do.
constexpr size_t kFewPieces = 64;
constexpr float kTogether = 4.0f;
// of a triangle: parts with less area are made by rounding
constexpr double kNothing = 1e-5;

/// What is part of one light as a whole: a triangle, or a part of one if its texels differ.
struct Unit {
  std::array<Vec3f, 3> corner;
  std::vector<LightPart> parts;  ///< what emits of it
};

/// Union-find over units that share a corner; returns a piece number per unit.
std::vector<uint32_t> connected_pieces(const std::vector<Unit>& units) {
  std::vector<uint32_t> parent(units.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::map<std::array<float, 3>, uint32_t> owner;
  for (uint32_t i = 0; i < units.size(); ++i)
    for (const Vec3f& p : units[i].corner) {
      const auto [entry, fresh] = owner.try_emplace({p.x, p.y, p.z}, i);
      if (!fresh) {
        const uint32_t a = root(entry->second), b = root(i);
        parent[std::max(a, b)] = std::min(a, b);
      }
    }
  std::vector<uint32_t> piece(units.size());
  for (uint32_t i = 0; i < units.size(); ++i) piece[i] = root(i);
  return piece;
}

/// Units that emit together, by number, and their bounds.
struct Piece {
  std::vector<uint32_t> units;
  Box bounds;
};

std::vector<Piece> pieces_of(const std::vector<Unit>& units) {
  std::map<uint32_t, Piece> pieces;
  const std::vector<uint32_t> number = connected_pieces(units);
  for (uint32_t i = 0; i < units.size(); ++i) {
    Piece& own = pieces[number[i]];
    own.units.push_back(i);
    for (const Vec3f& p : units[i].corner) own.bounds.grow(p);
  }
  std::vector<Piece> out;
  for (auto& [_, own] : pieces) out.push_back(std::move(own));
  return out;
}

/// Divides `pieces` at the median along their longest extent until those that remain together lie
/// close together; appends them to `out` as one each.
void join_close(std::span<Piece> pieces, std::vector<Piece>& out) {
  Box all, middles;
  float largest = 0;
  for (const Piece& own : pieces) {
    all.grow(own.bounds), middles.grow(own.bounds.centre());
    largest = std::max(largest, own.bounds.diagonal());
  }
  if (pieces.size() == 1 || all.diagonal() <= kTogether * largest) {
    Piece joined{{}, all};
    for (const Piece& own : pieces)
      joined.units.insert(joined.units.end(), own.units.begin(), own.units.end());
    std::sort(joined.units.begin(), joined.units.end());
    out.push_back(std::move(joined));
    return;
  }
  const Vec3f extent = middles.extent();
  const int axis = main_axis(extent);
  const size_t half = pieces.size() / 2;
  std::nth_element(pieces.begin(), pieces.begin() + long(half), pieces.end(),
                   [&](const Piece& a, const Piece& b) {
                     const float p = a.bounds.centre()[axis], q = b.bounds.centre()[axis];
                     return p != q ? p < q : a.units.front() < b.units.front();
                   });
  join_close(pieces.first(half), out);
  join_close(pieces.subspan(half), out);
}

/// Whether the light of `hidden` cannot be told from that of `hider`, which is seen in its place.
bool shines_instead(const scene::Face& hidden, uint32_t number, const scene::Face& other,
                    const scene::CoincidentFaces::Hider& hider) {
  if (!other.emits || hider.gap > scene::kSheet) return false;
  // Of two sheets that shine to both sides, each hides a side of the other.
  if (hider.gap > 0 && hidden.two_sided && other.two_sided) return hider.face < number;
  return !hider.from_back;
}

/// Appends what emits of a triangle: all of it, unless there is another one in its place.
void add_parts(const scene::Scene& scene, uint32_t index, uint32_t triangle,
               std::vector<LightPart>& out) {
  const scene::Object& object = scene.objects[index];
  const auto& indices = object.triangles[triangle];
  LightPart whole{triangle, {}};
  for (size_t k = 0; k < 3; ++k) whole.corner[k] = object.vertices[indices[k]];
  const uint32_t body = object.movable ? index : scene::kNone;
  const uint32_t number = object.movable ? triangle : object.first_primitive + triangle;
  const scene::Face own = scene.face(body, number);
  const Vec3d origin(own.corner[0]), u(Vec3d(own.corner[1]) - origin),
      v(Vec3d(own.corner[2]) - origin);
  const Vec3d across = cross(u, v);
  const double all = dot(across, across);
  // In barycentrics, which do not depend on the object's pose.
  std::vector<Polygon> seen{{{0, 0}, {1, 0}, {0, 1}}}, rest;
  bool hidden = false;
  for (const auto& hider : scene.coincident(body).of(number)) {
    const scene::Face other = scene.face(body, hider.face);
    if (!shines_instead(own, number, other, hider)) continue;
    hidden = true;
    Polygon hole;
    for (const Vec3f& p : other.corner) {
      const Vec3d d = Vec3d(p) - origin;
      hole.push_back({dot(cross(d, v), across) / all, dot(cross(u, d), across) / all});
    }
    rest.clear();
    for (const Polygon& part : seen) add_outside(part, hole, rest);
    seen.swap(rest);
  }
  if (!hidden) return out.push_back(whole);
  const Vec3d corner(whole.corner[0]), e(Vec3d(whole.corner[1]) - corner),
      f(Vec3d(whole.corner[2]) - corner);
  const auto at = [&](const Point& p) { return Vec3f(corner + e * p.x + f * p.y); };
  for (const Polygon& part : seen) {
    if (area_of(part) < kNothing) continue;
    for (size_t i = 2; i < part.size(); ++i) {
      const LightPart own{triangle, {at(part[0]), at(part[i - 1]), at(part[i])}};
      if (own.area() > 0) out.push_back(own);
    }
  }
}

/// Radiance of a part relative to the light's mean.
float brightness_of(const Light& light, const LightPart& part) {
  return float(photopic(Vec3d(part.radiance)) / photopic(Vec3d(light.strength)));
}

void finish_area_light(const scene::Scene& scene, Light& light) {
  const scene::Material& material = scene.materials[light.material];
  std::vector<double> areas;
  for (const LightPart& part : light.parts) areas.push_back(part.area());
  light.area = std::accumulate(areas.begin(), areas.end(), 0.0);
  light.strength = material.emission;
  if (material.glow) {
    Vec3d power{};
    for (size_t i = 0; i < areas.size(); ++i)
      power = power + Vec3d(light.parts[i].radiance) * areas[i];
    light.strength = Vec3f(power * (1 / light.area));
    light.brightest_part = 0;
    for (size_t i = 0; i < areas.size(); ++i) {
      const float own = brightness_of(light, light.parts[i]);
      areas[i] *= double(own);
      light.brightest_part = std::max(light.brightest_part, own);
    }
  }
  const double all = std::accumulate(areas.begin(), areas.end(), 0.0);
  double sum = 0;
  for (double a : areas) light.cumulative.push_back(float((sum += a) / all));
  light.cumulative.back() = 1.0f;
  light.two_sided = material.two_sided;
  light.power = Vec3d(light.strength) * (kPi * light.area * (light.two_sided ? 2 : 1));
}

/// Orders units along a curve, so that strata of a light, each of which holds some in sequence, are
/// compact.
void make_compact(const std::vector<Unit>& units, std::vector<uint32_t>& numbers) {
  constexpr size_t kFew = 8;
  if (numbers.size() <= kFew) return;
  std::vector<Vec3f> middles;
  for (const uint32_t number : numbers) {
    const auto& [a, b, c] = units[number].corner;
    middles.push_back((a + b + c) * (1.0f / 3));
  }
  std::vector<uint32_t> ordered;
  for (const uint32_t i : curve_order(middles, Curve::hilbert)) ordered.push_back(numbers[i]);
  numbers = std::move(ordered);
}

std::vector<Unit> units_of(const scene::Scene& scene, uint32_t index,
                           const std::vector<uint32_t>& triangles) {
  const scene::Object& object = scene.objects[index];
  const scene::Material& material = scene.materials[object.material[triangles.front()]];
  std::vector<Unit> units;
  std::vector<LightPart> all;
  for (const uint32_t t : triangles) {
    std::vector<LightPart> own;
    add_parts(scene, index, t, own);
    if (material.glow) {
      all.insert(all.end(), own.begin(), own.end());
      continue;
    }
    const auto& [a, b, c] = object.triangles[t];
    units.push_back({{object.vertices[a], object.vertices[b], object.vertices[c]}, std::move(own)});
  }
  if (material.glow)
    for (const LightPart& own : divided_by_glow(object, material, all))
      units.push_back({{own.corner[0], own.corner[1], own.corner[2]}, {own}});
  return units;
}

void add_area_lights(const scene::Scene& scene, uint32_t index, std::vector<Light>& lights) {
  const scene::Object& object = scene.objects[index];
  std::map<std::pair<uint32_t, uint32_t>, std::vector<uint32_t>> by_material;
  for (uint32_t t = 0; t < object.triangles.size(); ++t) {
    const Vec3f e = scene.materials[object.material[t]].emission;
    const Vec3d a(object.vertices[object.triangles[t][0]]),
        b(object.vertices[object.triangles[t][1]]), c(object.vertices[object.triangles[t][2]]);
    if (e == Vec3f{} || length(cross(b - a, c - a)) <= 0) continue;
    by_material[{object.material[t], object.group[t]}].push_back(t);
  }
  for (auto& [key, triangles] : by_material) {
    const std::vector<Unit> units = units_of(scene, index, triangles);
    std::vector<Piece> pieces = pieces_of(units);
    if (pieces.size() > kFewPieces) {
      std::vector<Piece> joined;
      join_close(pieces, joined);
      pieces = std::move(joined);
    }
    for (Piece& piece : pieces) {
      make_compact(units, piece.units);
      Light light;
      light.object = index;
      light.material = key.first;
      light.group = key.second;
      for (const uint32_t u : piece.units)
        light.parts.insert(light.parts.end(), units[u].parts.begin(), units[u].parts.end());
      if (light.parts.empty()) continue;
      finish_area_light(scene, light);
      place_light(scene, light);
      lights.push_back(std::move(light));
    }
  }
}

/// A place on an area light: `a` is the share of the power before it, `b` lies across.
struct Place {
  Vec3f point, normal;
  float slack;
  Vec3f origin(Vec3f n) const { return point + n * slack; }
};
Place place_on(const Light& light, float a, float b) {
  const auto entry = std::upper_bound(light.cumulative.begin(), light.cumulative.end() - 1, a);
  const size_t i = size_t(entry - light.cumulative.begin());
  const float below = i ? light.cumulative[i - 1] : 0.0f;
  const float share = light.cumulative[i] - below;
  a = share > 0 ? std::min((a - below) / share, 0x1.fffffep-1f) : 0.5f;
  // Map the square to the triangle with low distortion (Heitz 2019).
  if (b > a) {
    a *= 0.5f;
    b -= a;
  } else {
    b *= 0.5f;
    a -= b;
  }
  const LightTriangle& t = light.world[i];
  return {t.corner + t.edge_u * a + t.edge_v * b, t.normal, t.slack};
}

/// A cosine-distributed start; `side` and `turn`: random.
Emission emit_evenly(const Light& light, const Place& place, float side, float turn) {
  Vec3f n = place.normal;
  if (light.two_sided) {
    side *= 2;
    if (side >= 1) {
      side -= 1;
      n = -n;
    }
  }
  const float cosine = std::sqrt(1.0f - side);
  return {place.origin(n), on_cone(n, cosine, sine_of(cosine), turn)};
}

/// A start towards a target, or one of those that are not aimed. Weights make both together
/// unbiased (balance heuristic, Veach & Guibas 1995).
Emission emit_aimed(const Light& light, const AimMap& aims, const std::array<float, 4>& r) {
  constexpr float kAimed = AimMap::kAimed;
  const bool aimed = r[0] < kAimed;
  AimMap::Choice choice{};
  if (aimed)
    choice = aims.choose(r[0] / kAimed);
  else
    choice.place = std::min((r[0] - kAimed) / (1 - kAimed), 0x1.fffffep-1f);
  const Place place = place_on(light, choice.place, r[1]);
  const AimMap::Target* target = aimed ? &aims.targets[choice.target] : nullptr;
  const double versine = target ? AimMap::versine_of(*target, place.point) : AimMap::kInside;
  Emission out;
  if (versine == AimMap::kInside) {
    out = emit_evenly(light, place, r[2], r[3]);
  } else {
    const Vec3f axis = normalize(target->centre - place.point);
    const double own = double(r[2]) * versine;
    out.direction = on_cone(axis, float(1 - own), float(std::sqrt(own * (2 - own))), r[3]);
    const bool behind = light.two_sided && dot(out.direction, place.normal) < 0;
    out.origin = place.origin(behind ? -place.normal : place.normal);
  }
  const double above = double(dot(out.direction, place.normal));
  const double even = (light.two_sided ? 0.5 * std::fabs(above) : std::max(0.0, above)) / kPi;
  const double density =
      double(kAimed) * aims.density(choice.place, place.point, out.direction, target, even) +
      double(1 - kAimed) * even;
  out.weight = density > 0 ? float(even / density) : 0.0f;
  return out;
}

Emission emit_from_area(const Light& light, const std::array<float, 4>& r) {
  if (light.aims) return emit_aimed(light, *light.aims, r);
  return emit_evenly(light, place_on(light, r[0], r[1]), r[2], r[3]);
}

}  // namespace

std::vector<Light> find_lights(const scene::Scene& scene, uint32_t only_object) {
  std::vector<Light> lights;
  for (uint32_t i = 0; i < scene.lights.size() && only_object == scene::kNone; ++i) {
    const scene::PunctualLight& source = scene.lights[i];
    Light light;
    light.punctual.kind = source.kind;
    light.punctual.intensity = source.intensity;
    light.punctual.parameters = source.parameters;
    light.punctual.tables = source.kind->prepare(source.parameters);
    light.strength = source.intensity;
    light.concentration = source.kind->concentration(light.punctual);
    light.group = source.group;
    light.object = source.attached;
    light.source = i;
    place_light(scene, light);
    if (photopic(light.power) > 0) lights.push_back(std::move(light));
  }
  for (uint32_t i = 0; i < scene.objects.size(); ++i)
    if (only_object == scene::kNone || only_object == i) add_area_lights(scene, i, lights);
  return lights;
}

namespace {

void place_surface(const scene::Scene& scene, const Pose& pose, Light& light) {
  const scene::Object& object = scene.objects[light.object];
  const bool glows = scene.materials[light.material].glow != nullptr;
  light.world.clear();
  for (const LightPart& part : light.parts) {
    const Vec3f* local = part.corner;
    float slack = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3f p = pose.point(local[k]);
      light.bounds.grow(p);
      slack = std::max(slack, position_slack(p));
    }
    // Transform edges, not corners: far from the origin, corners may coincide in single precision.
    const Vec3d u = Vec3d(local[1]) - Vec3d(local[0]), v = Vec3d(local[2]) - Vec3d(local[0]);
    light.world.push_back({pose.point(local[0]), pose.direction(u), pose.direction(v),
                           pose.direction(normalize(cross(u, v))),
                           slack + scene.slack_of(object.first_primitive + part.triangle),
                           glows ? brightness_of(light, part) : 1.0f});
  }
}

void place_punctual(const scene::Scene& scene, const Pose& pose, Light& light) {
  const scene::PunctualLight& source = scene.lights[light.source];
  lights::Punctual& own = light.punctual;
  own.position = pose.point(Vec3f(source.position));
  own.direction = pose.direction(Vec3f(normalize(source.direction)));
  own.kind->place(own, pose, scene.first_world());
  const double extent = own.kind->extent(own);
  light.power = Vec3d(own.intensity) * extent;
  if (light.object != scene::kNone)
    light.max_power = own.kind->max_extent(own, scene.first_world()) / extent;
  if (!light.is_parallel()) light.bounds.grow(own.position);
}

}  // namespace

void place_light(const scene::Scene& scene, Light& light) {
  const bool attached = light.object != scene::kNone;
  light.on = !attached || scene.objects[light.object].present;
  light.bounds = {};
  const auto place = light.parts.empty() ? place_punctual : place_surface;
  place(scene, attached ? scene.objects[light.object].pose : Pose{}, light);
}

bool sends_alike(const Light& a, const Light& b) {
  return a.on == b.on && a.punctual == b.punctual && a.world == b.world;
}

bool may_reach(const Light& light, const Box& box) {
  if (box.empty()) return false;
  if (light.is_parallel()) return true;
  if (light.bounds.empty()) return false;
  const lights::Punctual& own = light.punctual;
  return !own.kind || own.kind->may_reach(own, box);
}

std::vector<double> shares_by_power(std::span<const Light> lights) {
  std::vector<double> shares;
  for (const Light& light : lights) shares.push_back(light.max_power * photopic(light.power));
  return shares;
}

namespace {

/// The `shares`, normalised to 1, with groups below the floor raised to it at the expense of the
/// others.
std::vector<double> with_group_floor(std::span<const Light> lights,
                                     std::span<const double> shares) {
  struct Group {
    double share = 0, lights = 0, wanted = 0;
  };
  std::map<uint32_t, Group> groups;
  double total = 0;
  for (size_t i = 0; i < lights.size(); ++i) {
    Group& group = groups[lights[i].group];
    group.share += shares[i], group.lights += 1;
    total += shares[i];
  }
  if (!(total > 0)) return {shares.begin(), shares.end()};
  const double floor = kGroupFloor / double(groups.size());
  double raised = 0, rest = 0;
  for (auto& [_, group] : groups) {
    group.wanted = std::max(floor, group.share / total);
    (group.wanted > floor ? rest : raised) += group.wanted;
  }
  for (auto& [_, group] : groups)
    if (group.wanted > floor) group.wanted *= (1 - raised) / rest;
  std::vector<double> out;
  for (size_t i = 0; i < lights.size(); ++i) {
    const Group& group = groups[lights[i].group];
    out.push_back(group.share > 0 ? group.wanted * shares[i] / group.share
                                  : group.wanted / group.lights);
  }
  return out;
}

}  // namespace

void allot_paths(std::vector<Light>& lights, std::span<const double> given, uint64_t paths,
                 uint32_t batches) {
  const std::vector<double> shares = with_group_floor(lights, given);
  double total = 0;
  for (double share : shares) total += share;
  const uint64_t unit = paths >= lights.size() * uint64_t(batches) ? batches : 1;
  const uint64_t rows = std::max<uint64_t>(paths / unit, lights.size());
  std::vector<std::pair<double, size_t>> remainder;
  uint64_t used = 0;
  for (size_t i = 0; i < lights.size(); ++i) {
    const double exact = total > 0 ? double(rows) * shares[i] / total : 0;
    const uint64_t whole = std::max<uint64_t>(1, uint64_t(exact));
    lights[i].path_count = whole * unit;
    used += whole;
    remainder.emplace_back(exact - double(whole), i);
  }
  std::sort(remainder.begin(), remainder.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  for (size_t k = 0; used < rows && !remainder.empty(); k = (k + 1) % remainder.size(), ++used)
    lights[remainder[k].second].path_count += unit;
  // Paths that do not fill a row of batches go to the light with the largest share, so that the sum
  // is `paths`.
  uint64_t sum = 0;
  for (const Light& light : lights) sum += light.path_count;
  if (!lights.empty()) {
    Light& most = lights[size_t(std::max_element(shares.begin(), shares.end()) - shares.begin())];
    if (sum < paths) most.path_count += paths - sum;
    if (sum > paths && most.path_count > sum - paths) most.path_count -= sum - paths;
  }
  uint64_t next = 0;
  for (Light& light : lights) {
    light.first_path = next;
    next += light.path_count;
  }
}

Emission emit(const Light& light, uint64_t seed, uint64_t index, uint32_t batches) {
  // Each (light, batch) is scrambled by its own key; the sequence restarts within the batch.
  const uint32_t batch = batch_of(light, index, batches);
  const uint64_t start = batch_begin(light, batch, batches);
  const uint64_t key = combine(combine(mix64(seed), light.first_path), batch);
  const std::array<float, 4> r = sobol::sample(uint32_t(index - start), key);
  if (!light.world.empty()) return emit_from_area(light, r);
  if (!light.map) return emit_from(light.punctual, r);
  const SunMap::Start place = light.map->start(r[0], r[1]);
  return emit_from(light.punctual, {place.u, place.v, r[2], r[3]}, place.weight);
}

}  // namespace deltalux::trace
