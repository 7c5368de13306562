// SPDX-License-Identifier: Apache-2.0
// Guides on their way to a session file and back.
#include <string>

#include "base/error.h"
#include "gather/sample_rays.h"

namespace deltalux::gather {
namespace {

constexpr const char* kGuides = "gather.guides";
constexpr const char* kBeams = "gather.beams";

static_assert(sizeof(Guide) == 4 * (10 + 33 * 33) && sizeof(BeamGuide) == 12);

[[noreturn]] void refuse(const char* array, const std::string& what) {
  throw FormatError("\"" + std::string(array) + "\": found " + what);
}

}  // namespace

void Guiding::save(ArchiveView& archive) const {
  archive.keep(kGuides, guides);
  archive.keep(kBeams, beams);
}

void Guiding::restore(ArchiveSource& archive, std::span<const trace::Light> lights) {
  const size_t count = archive.count<Guide>(kGuides), narrow = archive.count<BeamGuide>(kBeams);
  if (count > kMostGuides) refuse(kGuides, "more than " + std::to_string(kMostGuides));
  if (narrow > kMostBeams) refuse(kBeams, "more than " + std::to_string(kMostBeams));
  guides = archive.read_all<Guide>(kGuides, count);
  beams = archive.read_all<BeamGuide>(kBeams, narrow);
  for (const Guide& guide : guides)
    if (const char* flaw = guide.flaw()) refuse(kGuides, flaw);
  for (const BeamGuide& beam : beams)
    if (const char* flaw = beam.flaw(lights)) refuse(kBeams, flaw);
}

}  // namespace deltalux::gather
