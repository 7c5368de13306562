// SPDX-License-Identifier: Apache-2.0
// Hashes hits, visibilities and function values of fixed inputs.
#include "trace/description.h"

#include <bit>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "trace/embree_scene.h"

namespace deltalux::trace {
namespace {

constexpr uint32_t kTriangles = 512, kRays = 4096, kFans = 16, kArguments = 1024;

class Hash {
 public:
  void add(uint64_t bits) { value_ = combine(value_, bits); }
  void add(float number) { add(uint64_t(std::bit_cast<uint32_t>(number))); }
  void add(double number) { add(std::bit_cast<uint64_t>(number)); }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0;
};

Vec3f point_in_cube(const PathRandom& random, uint32_t index) {
  return {random(index, 0), random(index, 1), random(index, 2)};
}

/// Triangles about a tenth of the cube wide, each with a corner of the one before.
EmbreeScene some_triangles(const EmbreeDevice& device, std::vector<Vec3f>& corners) {
  const PathRandom random(1, 0);
  std::vector<std::array<uint32_t, 3>> triangles;
  for (uint32_t i = 0; i < kTriangles; ++i) {
    const Vec3f near = point_in_cube(random, i);
    const auto corner = uint32_t(corners.size());
    for (uint32_t k = 0; k < 3; ++k)
      corners.push_back(near + 0.1f * point_in_cube(random, kTriangles + 3 * i + k));
    triangles.push_back({corner, corner + 1, corner + 2});
    if (corner) triangles.push_back({corner - 1, corner, corner + 1});
  }
  return EmbreeScene(device, corners, triangles, nullptr);
}

/// Every other ray is aimed at a corner, or at the middle of an edge.
void add_hits(const EmbreeScene& scene, const std::vector<Vec3f>& corners, Hash& hash) {
  const PathRandom random(2, 0);
  for (uint32_t i = 0; i < kRays; ++i) {
    const Vec3f from = point_in_cube(random, 2 * i);
    const size_t corner = i % (corners.size() - 1);
    const Vec3f to = i % 2   ? point_in_cube(random, 2 * i + 1)
                     : i % 4 ? corners[corner]
                             : 0.5f * (corners[corner] + corners[corner + 1]);
    const Hit hit = scene.closest(0, from, to - from, 0, 2);
    hash.add(uint64_t(hit.primitive));
    for (const float number : {hit.t, hit.u, hit.v, hit.normal.x, hit.normal.y, hit.normal.z})
      hash.add(number);
    hash.add(uint64_t(scene.occluded(from, to - from, 1)));
  }
}

void add_visibilities(const EmbreeScene& scene, const std::vector<Vec3f>& corners, Hash& hash) {
  const PathRandom random(3, 0);
  for (uint32_t i = 0; i < kFans; ++i) {
    RayFan fan;
    fan.origin = point_in_cube(random, i);
    fan.count = RayFan::kMaxRays;
    RayBits wanted;
    wanted.fill(~uint64_t(0));
    for (size_t k = 0; k < fan.count; ++k) {
      const Vec3f d = corners[(i * fan.count + k) % corners.size()] - fan.origin;
      fan.x[k] = d.x, fan.y[k] = d.y, fan.z[k] = d.z;
    }
    for (const uint64_t word : scene.occluded(fan, wanted)) hash.add(word);
  }
}

void add_functions(Hash& hash) {
  const PathRandom random(4, 0);
  for (uint32_t i = 0; i < kArguments; ++i) {
    const float x = random(i, 0), y = random(i, 1);
    hash.add(std::sin(6.2831853f * x)), hash.add(std::cos(6.2831853f * x));
    hash.add(std::pow(x, y)), hash.add(std::acos(x)), hash.add(std::asin(x));
    hash.add(std::atan2(x, y)), hash.add(std::cbrt(x)), hash.add(std::hypot(x, y));
    hash.add(std::log(x)), hash.add(std::exp2(x)), hash.add(std::sqrt(x));
    const double wide = x + 0x1p-25 * y, angle = 6.283185307179586 * wide;
    hash.add(std::sin(angle)), hash.add(std::cos(angle)), hash.add(std::pow(wide, double(y)));
    hash.add(std::acos(wide)), hash.add(std::atan2(wide, double(y))), hash.add(std::cbrt(wide));
    hash.add(std::hypot(wide, double(y))), hash.add(std::log(wide)), hash.add(std::log2(wide));
  }
}

std::string make_description() {
  const EmbreeDevice device;
  std::vector<Vec3f> corners;
  const EmbreeScene scene = some_triangles(device, corners);
  Hash hash;
  add_hits(scene, corners, hash);
  add_visibilities(scene, corners, hash);
  add_functions(hash);
  std::string digits;
  for (int shift = 60; shift >= 32; shift -= 4)
    digits += "0123456789abcdef"[(hash.value() >> shift) & 15];
  return device.description() + ", build " DELTALUX_BUILD_ID ", arithmetic " + digits;
}

}  // namespace

const std::string& description() {
  static const std::string made = make_description();
  return made;
}

}  // namespace deltalux::trace
