// SPDX-License-Identifier: Apache-2.0
// Looks on their way to a session file and back: rays are dear to cast again.
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "gather/looks.h"

namespace deltalux::gather {
namespace {

constexpr const char* kComplete = "gather.complete";
constexpr const char* kTargets = "gather.targets";
constexpr const char* kWeights = "gather.weights";
constexpr const char* kInBeam = "gather.in_beam";
constexpr const char* kChains = "gather.chains";
constexpr const char* kVertices = "gather.vertices";

constexpr size_t kPerStep = size_t(1) << 16;  // rays between two looks at the cancel flag

/// At least half of the rays are even, so none counts more than twice, but for rounding.
constexpr float kMostWeight = 2.01f;

/// Of lamps as bright as a scene may have them; sums stay finite.
constexpr float kBrightest = 1e33f;

/// A chain without its vertices.
struct Record {
  uint32_t count, end;
  float weight;
  Passage passage;
};
static_assert(sizeof(Record) == 60 && sizeof(Vertex) == 20);

[[noreturn]] void refuse(const char* array, const std::string& what) {
  throw FormatError("\"" + std::string(array) + "\": " + what);
}

bool is_finite(Vec3f p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

void check(const Record& record, uint32_t cells) {
  if (record.count < 1 || record.count > kMostVertices)
    refuse(kChains, "found a chain of " + std::to_string(record.count) + " vertices");
  if (record.end != kDark && record.end >= cells) refuse(kChains, "found a cell that is not there");
  if (!(record.weight >= 0 && record.weight <= float(std::pow(kMostWeight, kMostVertices))))
    refuse(kChains, "found a weight no chain has");
  const Passage& passage = record.passage;
  for (Vec3f p : {passage.near.low, passage.near.high, passage.origin, passage.last})
    if (!is_finite(p)) refuse(kChains, "found a place that is not finite");
}

void check(const Vertex& vertex, const Present& present) {
  if ((vertex.material & ~Vertex::kEnd) >= present.scene.materials.size())
    refuse(kVertices, "found a material that is not there");
  const bool lit = vertex.light != scene::kNone;
  if (lit && vertex.light >= present.lights.size())
    refuse(kVertices, "found a light that is not there");
  if (vertex.is_of_end() && !lit)
    refuse(kVertices, "found light at a ray's end that is of no lamp");
  for (float value : vertex.direct)
    if (!(value >= 0 && value <= kBrightest) || (value > 0 && !lit))
      refuse(kVertices, "found light that is negative, beyond 1e33, or of no lamp");
}

}  // namespace

void Looks::save(ArchiveView& archive) const {
  // What waits is cast again as a whole: it is soon done.
  archive.keep(kComplete, std::vector<uint32_t>{!pending_});
  if (pending_) return;
  std::vector<uint32_t> targets = targets_;
  std::vector<Record> records;
  std::vector<Vertex> vertices;
  records.reserve(chains_.size());
  vertices.reserve(chains_.vertex_count());
  for (uint32_t& target : targets) {
    if (!is_chain(target)) continue;
    const uint32_t number = chain_of(target);
    const auto own = chains_.vertices(number);
    target = kChain + uint32_t(records.size());
    records.push_back({uint32_t(own.size()), chains_.end(number), chains_.weight(number),
                       chains_.passage(number)});
    vertices.insert(vertices.end(), own.begin(), own.end());
  }
  archive.keep(kTargets, std::move(targets));
  archive.append(kWeights, weights_);
  archive.append(kInBeam, in_beam_);
  archive.keep(kChains, std::move(records));
  archive.keep(kVertices, std::move(vertices));
}

void Looks::restore(ArchiveSource& archive, const Present& present, const Workers& workers,
                    Progress& progress) {
  if (!archive.read_all<uint32_t>(kComplete, 1)[0]) return cast(present, workers, progress);
  progress.begin("restore rays", rays_.all());
  targets_ = archive.read_all<uint32_t>(kTargets, rays_.all());
  const bool weighted = !present.guiding.empty(), beams = !present.guiding.beams.empty();
  weights_ = archive.read_all<float>(kWeights, weighted ? targets_.size() : 0);
  in_beam_ = archive.read_all<uint64_t>(kInBeam, beams ? (targets_.size() + 63) / 64 : 0);
  for (float weight : weights_)
    if (!(weight >= 0 && weight <= kMostWeight)) refuse(kWeights, "found a weight no ray has");
  const auto records = archive.read_all<Record>(kChains, archive.count<Record>(kChains));
  const auto vertices = archive.read_all<Vertex>(kVertices, archive.count<Vertex>(kVertices));
  const uint32_t cells = present.cells.size();
  chains_.clear();
  size_t next = 0;
  for (size_t ray = 0; ray < targets_.size(); ++ray) {
    if (ray % kPerStep == 0 && ray) {
      progress.advance(kPerStep);
      progress.check();
    }
    uint32_t& target = targets_[ray];
    if (!is_chain(target)) {
      if (target != kDark && target >= cells) refuse(kTargets, "found a cell that is not there");
      continue;
    }
    if (chain_of(target) != chains_.size() || chains_.size() >= records.size())
      refuse(kTargets, "found chains that are not in order");
    const Record& record = records[chains_.size()];
    check(record, cells);
    if (record.count > vertices.size() - next) refuse(kVertices, "is too short");
    const auto own = std::span(vertices).subspan(next, record.count);
    for (const Vertex& vertex : own) check(vertex, present);
    next += record.count;
    target = kChain + chains_.add(own, record.end, record.weight, record.passage);
  }
  if (chains_.size() != records.size()) refuse(kChains, "holds chains that no ray has");
  if (next != vertices.size()) refuse(kVertices, "is too long");
}

}  // namespace deltalux::gather
