// SPDX-License-Identifier: Apache-2.0
// Guides on their way to a session file and back.
#include <string>

#include "base/error.h"
#include "gather/sample_rays.h"

namespace deltalux::gather {
namespace {

constexpr const char* kGuides = "gather.guides";
constexpr const char* kBeams = "gather.beams";
constexpr const char* kNeed = "gather.need";
constexpr const char* kDoublings = "gather.doublings";

static_assert(sizeof(Guide) == 4 * (11 + 33 * 33) && sizeof(BeamGuide) == 12 &&
              sizeof(RayNeed) == 12);

[[noreturn]] void refuse(const char* array, const std::string& what) {
  throw FormatError("\"" + std::string(array) + "\": found " + what);
}

}  // namespace

void Guiding::save(ArchiveView& archive) const {
  archive.append(kGuides, guides);
  archive.append(kBeams, beams);
  archive.keep(kNeed, std::vector<RayNeed>{need});
  archive.append(kDoublings, doublings);
}

void Guiding::restore(ArchiveSource& archive, std::span<const trace::Light> lights,
                      size_t samples) {
  const size_t count = archive.count<Guide>(kGuides), narrow = archive.count<BeamGuide>(kBeams);
  if (count > kMostGuides) refuse(kGuides, "more than " + std::to_string(kMostGuides));
  if (narrow > kMostBeams) refuse(kBeams, "more than " + std::to_string(kMostBeams));
  guides = archive.read_all<Guide>(kGuides, count);
  beams = archive.read_all<BeamGuide>(kBeams, narrow);
  for (const Guide& guide : guides)
    if (const char* flaw = guide.flaw()) refuse(kGuides, flaw);
  for (const BeamGuide& beam : beams)
    if (const char* flaw = beam.flaw(lights)) refuse(kBeams, flaw);
  need = archive.read_all<RayNeed>(kNeed, 1)[0];
  if (const char* flaw = need.flaw()) refuse(kNeed, flaw);
  doublings = archive.read_all<int8_t>(kDoublings, samples);
  for (int8_t own : doublings)
    if (own < RayCounts::kLeast || own > RayCounts::kMost)
      refuse(kDoublings, "a number of rays no sample has");
}

}  // namespace deltalux::gather
