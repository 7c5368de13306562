// SPDX-License-Identifier: Apache-2.0
// Direct light by deterministic stratified shadow rays, kept exact under edits: once all lights
// have taken in all changes, the sums are those of a computation from scratch, to the bit.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "direct/visibility.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// The scene as it is now. Lights keep their numbers; later ones are appended.
struct Present {
  const trace::RayCaster& caster;
  std::span<const trace::Light> lights;
  std::span<const uint8_t> sampled;     ///< per light: 1 = done here
  std::span<const Receiver> receivers;  ///< per sample, world
};

/// What differs between two states of the scene.
struct Change {
  std::vector<Box> boxes;         ///< RayCaster::object_bounds before and after, of every movable
                                  ///< object that moved, appeared or vanished
  std::vector<uint32_t> lights;   ///< moved, switched on or off, or new
  std::vector<uint32_t> samples;  ///< receivers that changed
};

/// The most that one light counts at one sample, in quanta; reached only next to point lights. The
/// sums of 127 such lights still fit.
inline constexpr double kMaxWeight = 0x1p56;

class DirectLight {
 public:
  /// `irradiance_quantum`: irradiance per unit of the sums. Throws OptionError.
  DirectLight(size_t samples, uint32_t group_count, double irradiance_quantum, uint64_t seed);

  /// Everything from scratch. Throws Cancelled (within milliseconds) and leaves the object as it
  /// was; so does update().
  void compute(const Present& present, const Workers& workers, Progress& progress);
  /// Only what changes concern, this one and those that some light has yet to take in: receivers
  /// that a changed object's box may part from a light ask the movables between them again; the
  /// static scene is asked for changed lights and samples only. With `budget_ms` > 0 the lights
  /// take turns, at least one and as many as fit the time; an empty change lets the next ones
  /// follow.
  void update(const Present& present, const Change& change, const Workers& workers,
              Progress& progress, double budget_ms = 0);
  /// Share of the lights that have taken in all changes, 0 to 1.
  double current_share() const;

  /// In quanta, undimmed: sums()[(group * samples + sample) * 3 + channel].
  std::span<const int64_t> sums() const { return sums_; }
  double irradiance_quantum() const { return quantum_; }

  size_t bytes() const;
  static size_t forecast_bytes(size_t samples, uint32_t group_count,
                               std::span<const trace::Light> lights,
                               std::span<const uint8_t> sampled);
  /// Shadow rays that `samples` receivers will cost for `light`; one takes 25 to 120 ns on one core
  /// (office, atrium).
  static double estimated_rays(const trace::Light& light, size_t samples);

  /// Arrays named "direct.…", valid until this object changes.
  void save(ArchiveView& archive) const;
  /// The state that save() wrote, of the same samples, lights and seed. Throws FormatError.
  void restore(ArchiveSource& archive, std::span<const trace::Light> lights,
               std::span<const uint8_t> sampled);

 private:
  /// Per sample what one light gives. Empty for lights that are not done here.
  struct Column {
    uint32_t group = 0;
    Vec3d channel{};              ///< relative to the strongest
    uint64_t taken = 0;           ///< number of changes taken in
    std::vector<int64_t> weight;  ///< irradiance of the strongest channel in quanta
    std::vector<uint32_t> view;   ///< FixedView: a kind, else an index into partial_
  };
  struct PartialView {
    uint64_t coarse;
    trace::RayBits fine;
    double share;
  };
  struct Record;
  struct Found;
  class Outstanding;

  void check(std::span<const trace::Light> lights, std::span<const uint8_t> sampled) const;
  void check(const Present& present) const;
  std::vector<Column> make_columns(std::span<const trace::Light> lights,
                                   std::span<const uint8_t> sampled, size_t first) const;
  void add(const Column& column, size_t sample, int64_t weight, int sign);
  FixedView view_of(const Column& column, size_t sample) const;
  bool current(const Column& column) const {
    return column.weight.empty() || column.taken == past_ + recent_.size();
  }
  /// Lights that have yet to take in a change, the one whose turn it is first.
  std::vector<uint32_t> waiting() const;
  void find_changes(const Present& present, const Outstanding& outstanding,
                    std::span<const uint32_t> lights, const Workers& workers, Progress& progress,
                    std::vector<Found>& found) const;
  void make_room(const std::vector<Found>& found);  // so that commit() does not throw
  void commit(const std::vector<Found>& found);
  /// Forgets changes that all lights have taken in.
  void forget();

  size_t samples_;
  uint32_t group_count_;
  double quantum_;
  uint64_t seed_;
  std::vector<int64_t> sums_;
  std::vector<Column> columns_;  // per light
  std::vector<PartialView> partial_;
  std::vector<uint32_t> unused_;  // free places of partial_
  std::deque<Change> recent_;     // that some light has yet to take in, and later ones
  uint64_t past_ = 0;             // number of those before
  uint32_t turn_ = 0;             // the light that is next
};

}  // namespace deltalux::direct
