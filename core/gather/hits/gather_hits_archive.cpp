// SPDX-License-Identifier: Apache-2.0
// Saves hits to a session file and restores them, since recasting rays is expensive.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "gather/hits/gather_hits.h"

namespace deltalux::gather {
namespace {

constexpr const char* kComplete = "gather.complete";
constexpr const char* kTargets = "gather.targets";
constexpr const char* kWeights = "gather.weights";
constexpr const char* kInBeam = "gather.in_beam";
constexpr const char* kChains = "gather.chains";
constexpr const char* kVertices = "gather.vertices";
constexpr const char* kPlaces = "gather.places";
constexpr const char* kTints = "gather.tints";

constexpr size_t kPerStep = size_t(1) << 16;  // rays between two checks for cancellation

/// Upper bound of a ray's weight: at least half of the rays are cosine-distributed, so no weight
/// exceeds 2, except by rounding.
constexpr float kMaxWeight = 2.01f;

/// Upper bound of direct light at a vertex, for the brightest lights admitted; sums stay finite.
constexpr float kBrightest = 1e33f;

/// The largest weight of a chain.
const float kMaxChainWeight = float(std::pow(kMaxWeight, kMaxTouched));

/// A chain without its vertices, as stored in the file.
struct Record {
  uint32_t count, end;
  float weight;
  Vec3f tip;
};
static_assert(sizeof(Record) == 24 && sizeof(Vertex) == 16 && sizeof(Place) == 20);

[[noreturn]] void refuse(const char* array, const std::string& what) {
  throw FormatError("\"" + std::string(array) + "\": " + what);
}

bool is_finite(Vec3f p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

void check(const Record& record, uint32_t cells) {
  if (record.count < 1 || record.count > kMaxVertices)
    refuse(kChains, "found a chain of " + std::to_string(record.count) + " vertices");
  if (record.end != kDark && record.end >= cells) refuse(kChains, "found a cell that is not there");
  if (!(record.weight >= 0 && record.weight <= kMaxChainWeight))
    refuse(kChains, "found a weight no chain has");
  if (!is_finite(record.tip)) refuse(kChains, "found a place that is not finite");
}

void check(const Vertex& vertex, const Context& context) {
  if (vertex.is_factor()) {
    const Vec3f factor = vertex.factor();
    for (int c = 0; c < 3; ++c)
      if (!(factor[c] >= 0 && factor[c] <= Vertex::kMaxFactor))
        refuse(kVertices, "found a factor no lobe has");
    return;
  }
  if (vertex.material_index() >= context.scene.materials.size())
    refuse(kVertices, "found a material that is not there");
  if (!(vertex.weight >= 0 && vertex.weight <= kMaxChainWeight))
    refuse(kVertices, "found a weight no chain has");
  if (vertex.is_caustic()) {
    if (vertex.is_of_end() || vertex.light >= context.cells.size())
      refuse(kVertices, "found caustics of a cell that is not there");
    if (vertex.direct != 1) refuse(kVertices, "found a factor no caustics have");
    return;
  }
  const bool lit = vertex.light != scene::kNone;
  if (lit && vertex.light >= context.lights.size())
    refuse(kVertices, "found a light that is not there");
  if (vertex.is_of_end() && !lit)
    refuse(kVertices, "found light at a ray's end that is of no lamp");
  const Vec3f strength = lit ? context.lights[vertex.light].strength : Vec3f{};
  const float most = std::max({1.0f, strength.x, strength.y, strength.z}) * vertex.weight;
  if (!(vertex.direct >= 0 && vertex.direct <= kBrightest && vertex.direct * most <= kBrightest) ||
      (vertex.direct > 0 && !lit))
    refuse(kVertices, "found light that is negative, beyond 1e33, or of no lamp");
}

void check(const Place& place) {
  if (!is_finite(place.point())) refuse(kPlaces, "found a place that is not finite");
  if (!(place.plane >= 0 && std::isfinite(place.plane)))
    refuse(kPlaces, "found a distance from a surface that is negative or not finite");
}

/// Calls visit(chain) for all targets that are chains.
template <class Visit>
void each_chain(std::span<const uint32_t> targets, const Visit& visit) {
  for (uint32_t target : targets)
    if (GatherHits::is_chain(target)) visit(GatherHits::chain_of(target));
}

/// Reads the entries of an array in order; holds one block of them in memory.
template <class T>
class Entries {
 public:
  Entries(ArchiveSource& archive, const char* name)
      : archive_(archive), name_(name), left_(archive.count<T>(name)) {}
  size_t left() const { return left_ + block_.size() - next_; }
  /// Returns the next entry; left() must not be 0.
  const T& next() {
    if (next_ == block_.size()) {
      block_.resize(std::min(left_, kPerStep));
      archive_.read(name_, std::span<T>(block_));
      left_ -= block_.size();
      next_ = 0;
    }
    return block_[next_++];
  }

 private:
  ArchiveSource& archive_;
  const char* name_;
  size_t left_;  // in the archive
  std::vector<T> block_;
  size_t next_ = 0;
};

}  // namespace

void GatherHits::save(ArchiveView& archive) const {
  // Do not save hits while an update is pending: restore() then recasts all rays, which is soon
  // done.
  archive.keep(kComplete, std::vector<uint32_t>{!pending_});
  if (pending_) return;
  // In the file, chains and vertices are in the order of rays; sort them block by block.
  archive.append(kWeights, weights_);
  archive.append(kInBeam, in_beam_);
  // create the arrays even if they stay empty
  archive.append(kTargets, std::span<const uint32_t>{});
  archive.append(kChains, std::span<const Record>{});
  archive.append(kVertices, std::span<const Vertex>{});
  archive.append(kPlaces, std::span<const Place>{});
  archive.append(kTints, std::span<const Tint>{});
  for (size_t first = 0; first < targets_.size(); first += kPerStep) {
    const std::span block =
        std::span(targets_).subspan(first, std::min(kPerStep, targets_.size() - first));
    archive.make<uint32_t>(kTargets, block.size(), [block] {
      std::vector<uint32_t> out(block.begin(), block.end());
      std::replace_if(out.begin(), out.end(), is_chain, kChain);
      return out;
    });
    size_t own = 0, vertices = 0;
    each_chain(block, [&](uint32_t chain) { ++own, vertices += chains_.vertices(chain).size(); });
    archive.make<Record>(kChains, own, [this, block, own] {
      std::vector<Record> out;
      out.reserve(own);
      each_chain(block, [&](uint32_t chain) {
        out.push_back({uint32_t(chains_.vertices(chain).size()), chains_.end(chain),
                       chains_.weight(chain), chains_.tip(chain)});
      });
      return out;
    });
    const auto all_of = [this, block,
                         vertices]<class T>(std::span<const T> (ChainPool::*own)(uint32_t) const) {
      std::vector<T> out;
      out.reserve(vertices);
      each_chain(block, [&](uint32_t chain) {
        const std::span<const T> its = (chains_.*own)(chain);
        out.insert(out.end(), its.begin(), its.end());
      });
      return out;
    };
    archive.make<Vertex>(kVertices, vertices, [all_of] { return all_of(&ChainPool::vertices); });
    archive.make<Place>(kPlaces, vertices, [all_of] { return all_of(&ChainPool::places); });
    if (chains_.has_tints())
      archive.make<Tint>(kTints, vertices, [all_of] { return all_of(&ChainPool::tints); });
  }
}

void GatherHits::restore(ArchiveSource& archive, const Context& context, const Workers& workers,
                         Progress& progress) {
  if (!archive.read_all<uint32_t>(kComplete, 1)[0]) return cast(context, workers, progress);
  progress.begin("restore rays", rays_.all());
  archive.expect<uint32_t>(kTargets, rays_.all());  // before memory for them is allocated
  clear(context.guiding);
  restore_samples(0, samples(), archive, context, progress);
}

void GatherHits::restore_samples(size_t first_sample, size_t last_sample, ArchiveSource& archive,
                                 const Context& context, Progress& progress) {
  const size_t begin = rays_.first(first_sample), count = rays_.first(last_sample) - begin;
  archive.expect<uint32_t>(kTargets, count);
  archive.read(kTargets, std::span(targets_).subspan(begin, count));
  archive.expect<float>(kWeights, weights_.empty() ? 0 : count);
  if (!weights_.empty()) archive.read(kWeights, std::span(weights_).subspan(begin, count));
  for (size_t i = begin; i < begin + count && !weights_.empty(); ++i)
    if (!(weights_[i] >= 0 && weights_[i] <= kMaxWeight))
      refuse(kWeights, "found a weight no ray has");
  const auto bits = archive.read_all<uint64_t>(kInBeam, in_beam_.empty() ? 0 : (count + 63) / 64);
  for (size_t i = 0; i < count && !bits.empty(); ++i)
    in_beam_[(begin + i) / 64] |= (bits[i / 64] >> (i % 64) & 1) << ((begin + i) % 64);
  Entries<Record> records(archive, kChains);
  Entries<Vertex> vertices(archive, kVertices);
  Entries<Place> places(archive, kPlaces);
  if (places.left() != vertices.left()) refuse(kPlaces, "is not as long as the vertices");
  Entries<Tint> tints(archive, kTints);
  const bool tinted = tints.left();
  if (tinted && tints.left() != vertices.left()) refuse(kTints, "is not as long as the vertices");
  const uint32_t cells = context.cells.size();
  std::array<Vertex, kMaxVertices> own;
  std::array<Place, kMaxVertices> own_places;
  std::array<Tint, kMaxVertices> own_tints;
  for (size_t ray = 0; ray < count; ++ray) {
    if (ray % kPerStep == 0 && ray) {
      progress.advance(kPerStep);
      progress.check();
    }
    uint32_t& target = targets_[begin + ray];
    if (!is_chain(target)) {
      if (target != kDark && target >= cells) refuse(kTargets, "found a cell that is not there");
      continue;
    }
    if (target != kChain || !records.left()) refuse(kTargets, "found chains that are not in order");
    const Record record = records.next();
    check(record, cells);
    if (record.count > vertices.left()) refuse(kVertices, "is too short");
    for (uint32_t k = 0; k < record.count; ++k) {
      own[k] = vertices.next(), own_places[k] = places.next();
      if (tinted) own_tints[k] = tints.next();
      check(own[k], context), check(own_places[k]);
      if (k && own[k - 1].is_of_end() && !own[k].is_of_end())
        refuse(kVertices, "found a chain that goes on behind its end");
    }
    target = store(Points{own, own_places, own_tints}.subspan(0, record.count), record.end,
                   record.weight, record.tip);
  }
  if (records.left()) refuse(kChains, "holds chains that no ray has");
  if (vertices.left()) refuse(kVertices, "is too long");
}

}  // namespace deltalux::gather
