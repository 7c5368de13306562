// SPDX-License-Identifier: Apache-2.0
// Guides and shares of rays on their way to a session file and back.
#include <cmath>

#include "base/error.h"
#include "gather/sample_rays.h"

namespace deltalux::gather {
namespace {

constexpr const char* kGuides = "gather.guides";
constexpr const char* kShares = "gather.shares";

static_assert(sizeof(Guide) == 4 * (10 + 33 * 33) && sizeof(RayShares) == 4 * kMostUsed);

[[noreturn]] void refuse(const char* array, const std::string& what) {
  throw FormatError("\"" + std::string(array) + "\": " + what);
}

void check(const std::array<float, Guide::kSide + 1>& chances) {
  for (size_t i = 0; i < Guide::kSide; ++i)
    if (!(chances[i] <= chances[i + 1])) refuse(kGuides, "found chances that do not grow");
  if (chances.front() != 0 || chances.back() != 1) refuse(kGuides, "found chances beyond 0 and 1");
}

void check(const Guide& guide) {
  for (Vec3f v : {guide.centre, guide.normal})
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::fabs(v[axis]) <= kFarthest)) refuse(kGuides, "found a place that is not finite");
  for (float value : {guide.half, guide.radiosity, guide.brightest, guide.around})
    if (!(value > 0 && std::isfinite(value)))
      refuse(kGuides, "found a size or light that is not positive");
  check(guide.row);
  for (const auto& column : guide.column) check(column);
}

void check(const RayShares& shares, uint32_t rays, size_t guides) {
  for (uint32_t slot = 0; slot < kMostUsed; ++slot)
    if (shares.eighth[slot] && shares.guide[slot] >= guides)
      refuse(kShares, "found a guide that is not there");
  if (2 * kParts * shares.guided() > rays) refuse(kShares, "found more rays than a sample has");
}

}  // namespace

void Guiding::save(ArchiveView& archive) const {
  archive.keep(kGuides, guides);
  archive.keep(kShares, shares);
}

void Guiding::restore(ArchiveSource& archive, size_t samples, uint32_t rays) {
  const size_t count = archive.count<Guide>(kGuides);
  if (count > kMostGuides) refuse(kGuides, "found more than " + std::to_string(kMostGuides));
  guides = archive.read_all<Guide>(kGuides, count);
  shares = archive.read_all<RayShares>(kShares, count ? samples : 0);
  for (const Guide& guide : guides) check(guide);
  for (const RayShares& own : shares) check(own, rays, count);
}

}  // namespace deltalux::gather
