// SPDX-License-Identifier: Apache-2.0
// Casts rays by the cosine, and past corners of triangles, where openings end that are too small to
// be met by chance.
#include "gather/choose/sight_lines.h"

#include <algorithm>
#include <cmath>

#include "base/hemisphere.h"
#include "base/random.h"
#include "gather/choose/radiosity.h"
#include "trace/scatter.h"

namespace deltalux::gather {
namespace {

// Distance of a ray from the corner that it passes: scene metres, and the largest over the
// smallest.
constexpr float kNearest = 5e-4f, kRange = 400;
constexpr float kOblique = 0.05f;  // sine of the smallest angle between a ray and that triangle
constexpr uint32_t kMany = 16;     // looks of a texel that tell how bright it is
constexpr float kBehind = 1.001f;  // distances: a ray that ends farther away has passed

/// Whether the ray ends on the place of a guide.
bool is_known(std::span<const Guide> known, Vec3f from, Vec3f w, float t) {
  return std::any_of(known.begin(), known.end(), [&](const Guide& guide) {
    const float beyond = dot(from + w * t - guide.centre, guide.normal);
    return std::fabs(beyond) <= guide.rise && Square(guide).density(from, w) > 0;
  });
}

}  // namespace

float Eyes::radiosity(Vec3f from, Vec3f w, float beyond) const {
  const auto [hit, cell] = meet(context, finder, from, w);
  if (cell == kNoCell || hit.t < beyond) return 0;
  return radiosity_at(context, evaluation, from, w, hit, cell);
}

Look Eyes::look(const direct::Receiver& receiver) const {
  struct End {
    Vec3f w;
    float t, radiosity;
  };
  std::vector<End> ends;
  const Vec3f from = origin(receiver);
  double all = 0;
  for (uint32_t ray = 0; ray < rays; ++ray) {
    const Vec3f w = directions(receiver.key, ray, receiver.normal);
    const auto [hit, cell] = meet(context, finder, from, w);
    if (cell == kNoCell || hit.t < context.cells.near(cell)) continue;
    const float radiosity = radiosity_at(context, evaluation, from, w, hit, cell);
    if (!std::isfinite(radiosity)) continue;
    all += double(radiosity);
    ends.push_back({w, hit.t, radiosity});
  }
  Look out;
  if (!(all > 0)) return out;
  out.around = float(all / rays);
  for (const End& own : ends) {
    const double share = double(own.radiosity) / all;
    out.variance += share * share;
    if (own.radiosity > kBright * out.around && !is_known(known, from, own.w, own.t))
      out.bright.push_back({from, own.w, own.t, out.around, share * share});
  }
  look_past_corners(receiver, out);
  return out;
}

void Eyes::look_past_corners(const direct::Receiver& receiver, Look& out) const {
  const uint32_t triangles = context.scene.static_primitives();
  if (triangles == 0) return;
  const Vec3f from = origin(receiver);
  const float nearest = kNearest * context.cells.metre();
  for (uint32_t k = 0; k < corners; ++k) {
    const PathRandom random(combine(seed, receiver.key), k);
    const uint32_t primitive = std::min(uint32_t(random(0, 0) * float(triangles)), triangles - 1);
    const scene::Face face = context.scene.face(scene::kNone, primitive);
    const Vec3f corner = face.corner[std::min(int(3 * random(0, 1)), 2)], d = corner - from;
    if (!(dot(d, receiver.normal) > 0)) continue;
    Vec3f u, v;
    tangent_frame(normalize(d), u, v);
    const float away = nearest * std::pow(kRange, random(0, 2));
    const Vec3f w = normalize(d + on_circle(u, v, random(0, 3)) * away);
    if (!(dot(w, receiver.normal) > 0)) continue;
    Vec3f n = face.normal();
    if (dot(n, w) > 0) n = -n;
    const float along = dot(w, n), t = dot(d, n) / along;
    if (!(along < -kOblique) || !(t > 0)) continue;
    const auto [hit, cell] = meet(context, finder, from, w);
    if (cell == kNoCell || hit.t < kBehind * t || is_known(known, from, w, hit.t)) continue;
    if (radiosity_at(context, evaluation, from, w, hit, cell) > kBright * out.around)
      out.passing.push_back({from, primitive, from + w * t, n, out.around});
  }
}

void paint(const Eyes& eyes, std::span<const Vec3f> from, uint32_t looks, Guide& guide) {
  constexpr uint32_t kSide = Guide::kSide;
  Guide::Texels texel{};
  for (uint32_t k = 0; k < kSide; ++k)
    for (uint32_t i = 0; i < kSide; ++i)
      for (uint32_t n = 0; n < looks; ++n) {
        const uint32_t which = (k * kSide + i) * looks + n;
        const auto r = sobol::sample(n, combine(eyes.seed, k * kSide + i));
        const Vec3f start = from[which % from.size()];
        const Vec3f d = guide.point((float(i) + r[0]) / kSide, (float(k) + r[1]) / kSide) - start;
        const float distance = length(d);
        const float seen = eyes.radiosity(start, d * (1 / distance), distance - guide.rise);
        texel[k][i] += seen / float(looks);
      }
  guide.set_texels(texel, looks >= kMany);
}

}  // namespace deltalux::gather
