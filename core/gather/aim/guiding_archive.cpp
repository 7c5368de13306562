// SPDX-License-Identifier: Apache-2.0
// Writes guides to a session file and reads them back.
#include <string>

#include "base/error.h"
#include "gather/aim/sample_rays.h"
#include "gather/aim/suns.h"

namespace deltalux::gather {
namespace {

constexpr const char* kGuides = "gather.guides";
constexpr const char* kBeams = "gather.beams";
constexpr const char* kSuns = "gather.suns";
constexpr const char* kNeed = "gather.need";
constexpr const char* kDoublings = "gather.doublings";
constexpr const char* kAllotments = "gather.shares";

static_assert(sizeof(Guide) == 4 * (11 + 33 * 33) && sizeof(BeamGuide) == 12 &&
              sizeof(RayNeed) == 12 && sizeof(RayAllotment) == 32);

[[noreturn]] void refuse(const char* array, const std::string& what) {
  throw FormatError("\"" + std::string(array) + "\": found " + what);
}

/// Why a sample with `rays` rays cannot have these allotments; null if it can.
const char* flaw(const RayAllotment& allotments, uint32_t rays, size_t guides, size_t beams) {
  if (allotments.guided() > rays / (2 * kParts)) return "more guided rays than a sample has";
  for (size_t slot = 0; slot < kMaxUsed; ++slot) {
    if (allotments.eighth[slot] && !Targets::has(allotments.target[slot], guides, beams))
      return "a guide that is not there";
  }
  return nullptr;
}

/// Saves what belongs to no sample.
void save_chosen(const Guiding& guiding, ArchiveView& archive) {
  archive.append(kGuides, guiding.guides);
  archive.append(kBeams, guiding.beams);
  archive.append(kSuns, guiding.suns);
  archive.keep(kNeed, std::vector<RayNeed>{guiding.need});
}

}  // namespace

void Guiding::save(ArchiveView& archive, bool current) const {
  save_chosen(*this, archive);
  archive.append(kDoublings, doublings);
  if (current && !empty()) archive.append(kAllotments, allotments);
}

void Guiding::save_samples(size_t first, size_t last, ArchiveView& archive) const {
  save_chosen(*this, archive);
  archive.append(kDoublings, std::span(doublings).subspan(first, last - first));
  if (!empty() && last > first)
    archive.append(kAllotments, std::span(allotments).subspan(first, last - first));
}

void Guiding::restore(ArchiveSource& archive, std::span<const trace::Light> lights, size_t samples,
                      uint32_t rays) {
  const size_t count = archive.count<Guide>(kGuides), narrow = archive.count<BeamGuide>(kBeams);
  if (count > kMaxGuides) refuse(kGuides, "more than " + std::to_string(kMaxGuides));
  if (narrow > kMaxBeams) refuse(kBeams, "more than " + std::to_string(kMaxBeams));
  guides = archive.read_all<Guide>(kGuides, count);
  beams = archive.read_all<BeamGuide>(kBeams, narrow);
  for (const Guide& guide : guides)
    if (const char* flaw = guide.flaw()) refuse(kGuides, flaw);
  for (const BeamGuide& beam : beams)
    if (const char* flaw = beam.flaw(lights)) refuse(kBeams, flaw);
  const size_t shining = archive.count<uint32_t>(kSuns);
  if (shining > lights.size()) refuse(kSuns, "more than there are lights");
  suns = archive.read_all<uint32_t>(kSuns, shining);
  if (const char* flaw = Suns::flaw(suns, lights)) refuse(kSuns, flaw);
  need = archive.read_all<RayNeed>(kNeed, 1)[0];
  if (const char* flaw = need.flaw()) refuse(kNeed, flaw);
  doublings = archive.read_all<int8_t>(kDoublings, samples);
  for (int8_t own : doublings)
    if (own < RayCounts::kMinDoublings || own > RayCounts::kMaxDoublings)
      refuse(kDoublings, "a number of rays no sample has");
  allotments.clear();
  if (empty() || !archive.bytes(kAllotments)) return;
  allotments = archive.read_all<RayAllotment>(kAllotments, samples);
  for (size_t i = 0; i < samples; ++i)
    if (const char* wrong =
            flaw(allotments[i], RayCounts::rays(rays, doublings[i]), guides.size(), beams.size()))
      refuse(kAllotments, wrong);
}

}  // namespace deltalux::gather
