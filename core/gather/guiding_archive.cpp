// SPDX-License-Identifier: Apache-2.0
// Guides and shares of rays on their way to a session file and back.
#include <string>

#include "base/error.h"
#include "gather/sample_rays.h"

namespace deltalux::gather {
namespace {

constexpr const char* kGuides = "gather.guides";
constexpr const char* kShares = "gather.shares";

static_assert(sizeof(Guide) == 4 * (10 + 33 * 33) && sizeof(RayShares) == 4 * kMostUsed);

[[noreturn]] void refuse(const char* array, const std::string& what) {
  throw FormatError("\"" + std::string(array) + "\": found " + what);
}

void check(const RayShares& shares, uint32_t rays, size_t guides) {
  for (uint32_t slot = 0; slot < kMostUsed; ++slot)
    if (shares.eighth[slot] && shares.guide[slot] >= guides)
      refuse(kShares, "a guide that is not there");
  if (2 * kParts * shares.guided() > rays) refuse(kShares, "more rays than a sample has");
}

}  // namespace

void Guiding::save(ArchiveView& archive) const {
  archive.keep(kGuides, guides);
  archive.keep(kShares, shares);
}

void Guiding::restore(ArchiveSource& archive, size_t samples, uint32_t rays) {
  const size_t count = archive.count<Guide>(kGuides);
  if (count > kMostGuides) refuse(kGuides, "more than " + std::to_string(kMostGuides));
  guides = archive.read_all<Guide>(kGuides, count);
  shares = archive.read_all<RayShares>(kShares, count ? samples : 0);
  for (const Guide& guide : guides)
    if (const char* flaw = guide.flaw()) refuse(kGuides, flaw);
  for (const RayShares& own : shares) check(own, rays, count);
}

}  // namespace deltalux::gather
