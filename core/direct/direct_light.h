// SPDX-License-Identifier: Apache-2.0
// Direct light by deterministic, stratified shadow rays, kept exact under edits: once all lights
// are up to date with all changes, the sums equal those of a computation from scratch, to the bit.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "direct/scales.h"
#include "direct/view_code.h"
#include "direct/visibility.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// What direct light is computed from: the scene as it is now. Lights keep their indices; new
/// lights are appended.
struct Context {
  const trace::RayCaster& caster;
  std::span<const trace::Light> lights;
  std::span<const uint8_t> sampled;     ///< 1 for each light whose direct light is computed here
  std::span<const Receiver> receivers;  ///< by sample, in world space
};

/// The difference between two states of the scene, as far as direct light depends on it.
struct DirectChange {
  /// RayCaster::object_bounds() before and after, of every movable object that was moved, added or
  /// removed
  std::vector<Box> boxes;
  std::vector<uint32_t> lights;   ///< moved, switched on or off, or new
  std::vector<uint32_t> samples;  ///< receivers that were moved or removed
};

/// Lights whose light is added in one integer sum by sample and channel.
struct Part {
  uint32_t group;  ///< of lights
  double quantum;  ///< irradiance per unit, see quantum_of()
  friend bool operator==(const Part&, const Part&) = default;
};

/// The direct light of all samples.
class DirectLight {
 public:
  /// Throws OptionError.
  DirectLight(size_t samples, const Scales& scales, uint64_t seed);

  /// Computes everything. Throws Cancelled (within milliseconds) and leaves the object as it was;
  /// so does update().
  void compute(const Context& context, const Workers& workers, Progress& progress);
  /// Forgets all light: samples are dark until restore_samples() brings theirs.
  void clear(std::span<const trace::Light> lights, std::span<const uint8_t> sampled);
  /// Applies this change and any that lights still lag behind on. A receiver's visibility of a
  /// light is tested again, against movable objects, if a changed object's shadow volume contains
  /// the receiver; against static geometry only if the light or the receiver itself changed. With
  /// `budget_ms` > 0, lights are updated in turn: at least one, and as many as fit the time; call
  /// with an empty change to update the next ones.
  void update(const Context& context, const DirectChange& change, const Workers& workers,
              Progress& progress, double budget_ms = 0);
  /// The share of the lights that are up to date, from 0 to 1.
  double current_share() const;

  /// In the order of the lights; new lights append those that are missing.
  std::span<const Part> parts() const { return parts_; }
  /// In quanta of the part, without dimming: sums()[(part * samples + sample) * 3 + channel].
  std::span<const int64_t> sums() const { return sums_; }
  const Scales& scales() const { return scales_; }
  /// Calls visit(word) for each 64-bit word of what all light depends on: the sums, and by light
  /// and sample its weight and its fixed view.
  void each_word(const std::function<void(uint64_t)>& visit) const;
  /// Adds the variance of what the sums of a part mean, in squared quanta, without dimming, to
  /// out[3 * (sample - begin) + channel] times `factor`, for begin <= sample < end.
  void add_variance(uint32_t part, size_t begin, size_t end, double factor, double* out) const;

  size_t bytes() const;
  /// Predicts bytes().
  static size_t forecast_bytes(size_t samples, uint32_t group_count,
                               std::span<const trace::Light> lights,
                               std::span<const uint8_t> sampled);
  /// The expected number of shadow rays for `samples` receivers and this light, one of `lights`.
  /// One ray takes 25 to 120 ns on one core (office, atrium).
  static double estimated_rays(const trace::Light& light, size_t samples, size_t lights);

  /// Writes arrays named "direct.…", valid until this object changes.
  void save(ArchiveView& archive) const;
  /// Restores what save() wrote, for the same samples, lights and seed. Throws FormatError.
  void restore(ArchiveSource& archive, std::span<const trace::Light> lights,
               std::span<const uint8_t> sampled);
  /// Restores the samples from `first` on, which are dark, from what an up-to-date object of
  /// `count` samples alone saved. Throws FormatError; this object is then useless.
  void restore_samples(size_t first, size_t count, ArchiveSource& archive);

 private:
  /// What one light gives to each sample. Empty for lights that are not computed here.
  struct Column {
    uint32_t part = 0;
    double quantum = 1;           ///< irradiance per unit of `weight`
    Vec3d channel{};              ///< colour relative to the strongest channel
    uint64_t taken = 0;           ///< number of changes that are taken into account
    std::vector<int64_t> weight;  ///< by sample: irradiance of the strongest channel in quanta
    std::vector<uint16_t> error;  ///< of area lights, by sample: standard error, see code_of()
    std::vector<uint32_t> view;   ///< by sample: the FixedView's kind, or an index into partial_
  };
  /// Light and error of one pair.
  struct Weight {
    int64_t light = 0;
    uint16_t error = 0;
    friend bool operator==(const Weight&, const Weight&) = default;
  };
  struct Record;
  struct BlockChanges;
  class Outstanding;

  /// Throws OptionError if sizes do not fit.
  static void check(std::span<const trace::Light> lights, std::span<const uint8_t> sampled);
  void check(const Context& context) const;
  /// Appends empty columns of the lights that have none, and the sums that these need.
  void append_columns(std::span<const trace::Light> lights, std::span<const uint8_t> sampled);
  /// Drops the last columns and parts.
  void shrink(size_t columns, size_t parts);
  /// Adds (sign 1) or removes (-1) what a light gives to a sample.
  void add(const Column& column, size_t sample, int64_t weight, int sign);
  /// Replaces what a light gives to a sample.
  void set(Column& column, size_t sample, Weight weight);
  Weight weight_of(const Column& column, size_t sample) const;
  FixedView view_of(const Column& column, size_t sample) const;
  /// Irradiance of the light's strongest channel.
  static Weight weigh(const Context& context, const LightShape& shape, const Column& column,
                      size_t sample, double open, const FixedView& view,
                      std::span<const uint32_t> movables);
  /// Whether the light is up to date.
  bool current(const Column& column) const {
    return column.weight.empty() || column.taken == past_ + recent_.size();
  }
  /// The lights that are not up to date, beginning with the one whose turn it is.
  std::vector<uint32_t> waiting() const;
  /// Finds what outstanding changes alter for the given lights; changes nothing.
  void find_changes(const Context& context, const Outstanding& outstanding,
                    std::span<const uint32_t> lights, const Workers& workers, Progress& progress,
                    std::vector<BlockChanges>& found) const;
  // reserves memory, so that commit() cannot throw
  void make_room(const std::vector<BlockChanges>& found);
  /// Applies the changes found.
  void commit(const std::vector<BlockChanges>& found);
  /// Drops changes that all lights have taken into account.
  void forget();

  size_t samples_;
  Scales scales_;
  uint64_t seed_;
  std::vector<Part> parts_;
  std::vector<int64_t> sums_;
  std::vector<Column> columns_;  // by light
  std::vector<StoredView> partial_;
  std::vector<uint32_t> unused_;  // free entries of partial_
  std::deque<DirectChange>
      recent_;         // from the first one that some light does not take into account
  uint64_t past_ = 0;  // number of changes dropped before recent_
  uint32_t turn_ = 0;  // index of the light whose turn is next
};

}  // namespace deltalux::direct
