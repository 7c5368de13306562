// SPDX-License-Identifier: Apache-2.0
// The rule for radii that gave the best results in rooms: noise falls with d, blur grows with d^2.
#include "samples/placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/random.h"
#include "samples/disc_area.h"
#include "trace/scatter.h"

namespace deltalux::samples {
namespace {

constexpr float kShareOfRoom = 0.8f;    // of the harmonic mean distance to the surroundings
constexpr float kMetrePerRoom = 0.12f;  // of a room's diagonal
// share of the hit points ignored at either end, such as those seen through windows
constexpr float kTail = 0.05f;
constexpr int kRays = 16;        // rays from a sample
constexpr int kWalks = 8;        // how many of those rays continue
constexpr int kBounces = 3;      // how many times they continue
constexpr int kEnclosed = 12;    // so many of those rays from a point in a room end on its surfaces
constexpr size_t kRoom = 8;      // least number of such points
constexpr float kSite = 3;       // multiple of a room's size from which on others are a site
constexpr int kMinFlights = 10;  // segments, of 40, that must hit something to determine a size

/// Directions around +z: uniform over the hemisphere for rays, cosine-distributed for bounces.
struct Directions {
  std::array<Vec3f, kRays> ray;
  std::array<std::array<Vec3f, kBounces>, kWalks> bounce;
  Directions() {
    const auto around = [](float height, float turn) {
      const float flat = std::sqrt(1 - height * height), phi = 2 * std::numbers::pi_v<float> * turn;
      return Vec3f{std::cos(phi) * flat, std::sin(phi) * flat, height};
    };
    for (int k = 0; k < kRays; ++k)
      ray[k] = around((float(k) + 0.5f) / kRays, sobol::sample(uint32_t(k), 7)[0]);
    for (int k = 0; k < kWalks; ++k)
      for (int b = 0; b < kBounces; ++b) {
        const auto r = sobol::sample(uint32_t(k), 8 + uint64_t(b));
        bounce[k][b] = around(std::sqrt(1 - r[0]), r[1]);
      }
  }
};

/// What short walks from a point hit.
struct Surroundings {
  float inverse_sum = 0;  ///< sum of the rays' inverse distances
  std::array<Vec3f, kRays + kWalks * kBounces> ends;
  /// Number of segments that hit something, and of those that hit a back side.
  int ended = 0, on_backs = 0;
  /// Number of the rays from the point itself that end on other things than a luminous sky.
  int enclosed = 0;

  /// A share of the diagonal of the box that contains most hit points.
  std::optional<float> metre() const {
    if (ended < kMinFlights) return std::nullopt;
    Vec3f size{};
    std::array<float, kRays + kWalks * kBounces> along;
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < ended; ++i) along[size_t(i)] = ends[size_t(i)][axis];
      std::sort(along.begin(), along.begin() + ended);
      const int tail = int(kTail * float(ended));
      size[axis] = along[size_t(ended - 1 - tail)] - along[size_t(tail)];
    }
    return kMetrePerRoom * length(size);
  }
  float harmonic() const {
    return inverse_sum > 0 ? kRays / inverse_sum : std::numeric_limits<float>::infinity();
  }
};

Surroundings look_around(const scene::Scene& scene, const trace::RayCaster& caster, Vec3f origin,
                         Vec3f normal) {
  static const Directions directions;
  Surroundings found;
  const auto is_sky = [&](const trace::Hit& hit) {
    const scene::Material& own = scene.material_of(hit.primitive);
    return own.reflectance == Vec3f{} && own.emission != Vec3f{};
  };
  const auto fly = [&](Vec3f at, Vec3f w) {
    const trace::Hit hit = caster.closest_static(at, w);
    if (hit.valid()) {
      found.ends[size_t(found.ended++)] = at + w * hit.t;
      found.on_backs += dot(hit.normal, w) > 0;
    }
    return hit;
  };
  for (int k = 0; k < kRays; ++k) {
    Vec3f at = origin, w = turned(directions.ray[k], normal);
    trace::Hit hit = fly(at, w);
    found.enclosed += hit.valid() && !is_sky(hit);
    if (hit.valid()) found.inverse_sum += 1 / std::max(hit.t, std::numeric_limits<float>::min());
    // Continue every other ray: rays are ordered by height.
    for (int b = 0; k % (kRays / kWalks) == 0 && b < kBounces && hit.valid(); ++b) {
      const Vec3f n = trace::facing_normal(hit, w);
      at = trace::leave_surface(at, w, hit, n, scene.slack_of(hit.primitive));
      w = turned(directions.bounce[k / (kRays / kWalks)][b], n);
      hit = fly(at, w);
    }
  }
  return found;
}

}  // namespace

float scene_metre(const scene::Scene& scene, const trace::RayCaster& caster) {
  constexpr uint32_t kPoints = 256;
  const float all = 0.1f * scene.first_world().diagonal();
  const uint32_t triangles = scene.static_primitives();
  // inner: of points from which all hits are back sides, such as inside a solid; enclosed: of
  // points in rooms, which see little of the sky or of nothing
  std::vector<float> metres, inner, enclosed;
  uint32_t object = 0;
  for (uint32_t i = 0; i < kPoints && triangles; ++i) {
    const uint32_t primitive = uint32_t(uint64_t(i) * triangles / kPoints);
    while (primitive >=
           scene.objects[object].first_primitive + uint32_t(scene.objects[object].triangles.size()))
      ++object;
    const scene::Object& own = scene.objects[object];
    Vec3f p[3];
    for (int k = 0; k < 3; ++k)
      p[k] = own.pose.point(own.vertices[own.triangles[primitive - own.first_primitive][k]]);
    const Vec3d across = cross(Vec3d(p[1] - p[0]), Vec3d(p[2] - p[0]));
    if (!(dot(across, across) > 0)) continue;
    auto r = sobol::sample(i, 6);
    if (r[0] + r[1] > 1) r[0] = 1 - r[0], r[1] = 1 - r[1];
    const Vec3f at = p[0] + (p[1] - p[0]) * r[0] + (p[2] - p[0]) * r[1];
    const float slack = position_slack(at) + scene.slack_of(primitive);
    for (const float side : {1.0f, -1.0f}) {
      const Vec3f n = Vec3f(normalize(across)) * side;
      const Surroundings around = look_around(scene, caster, at + n * slack, n);
      const auto metre = around.metre();
      if (!metre) continue;
      (around.on_backs == around.ended ? inner : metres).push_back(*metre);
      if (around.enclosed >= kEnclosed) enclosed.push_back(*metre);
    }
  }
  if (metres.empty()) metres = std::move(inner);  // a bare room whose triangles are wound outwards
  if (metres.empty()) return all;
  // A high quantile: niches and shelves have many triangles, outer walls that see the ground have
  // few.
  const auto typical = [](std::vector<float>& of) {
    const auto quantile = of.begin() + long(0.75 * double(of.size()));
    std::nth_element(of.begin(), quantile, of.end());
    return *quantile;
  };
  const float everywhere = typical(metres);
  // Of a site with a house, most triangles may be those of the sky and of outer walls.
  if (enclosed.size() < kRoom) return everywhere;
  const float inside = typical(enclosed);
  return kSite * inside < everywhere ? inside : everywhere;
}

void resolve_lengths(const scene::Scene& scene, const trace::RayCaster& caster, uint64_t paths,
                     const Workers& workers, Progress& progress, SampleSet& samples) {
  const float elsewhere = scene_metre(scene, caster);
  const Ground ground{scene, caster, 0, scene.first_world()};
  // Noise (variance) falls with 1 / (paths d^2), squared blur grows with d^4.
  const float balance = float(std::pow(1e6 / double(std::max<uint64_t>(1, paths)), 1.0 / 6));
  const float least = 0.1f * balance, most = 0.2f * balance;
  std::vector<float> size(scene.objects.size());
  for (size_t i = 0; i < size.size(); ++i)
    if (scene.objects[i].movable) size[i] = scene::bounds_at(scene.objects[i], {}).diagonal();
  progress.begin("disc radii", samples.size());
  workers.for_blocks(samples.size(), 512, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i) {
      if (!std::isnan(samples.radius[i])) continue;
      if (const uint32_t object = samples.attached[i]; object != scene::kNone) {
        // A moving object's surroundings change: use half of the usual upper bound.
        const float half = 0.5f * size[object];
        samples.radius[i] = std::min(0.5f * most * elsewhere, half > 0 ? half : elsewhere);
        continue;
      }
      const Vec3f n = samples.normal[i];
      // Start at the height of the highest disc: on a vertex of a concave mesh, adjacent faces rise
      // above the tangent plane, but do not belong to the surroundings.
      const float slack = rounding_above(ground, samples.point[i], n, 1e-3f * elsewhere);
      const Vec3f above = samples.point[i] + n * slack;
      const float lift = kLift * most * elsewhere;
      const float room = caster.closest_static(above, n, 0.0f, 2 * lift).t;
      const Surroundings around =
          look_around(scene, caster, above + n * std::min(lift, 0.5f * room), n);
      const float metre = std::max(around.metre().value_or(elsewhere), elsewhere);
      const float wanted = kShareOfRoom * around.harmonic();
      samples.radius[i] = std::clamp(wanted, least * metre, most * metre);
    }
    progress.advance(end - begin);
  });
}

}  // namespace deltalux::samples
