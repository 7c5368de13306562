// SPDX-License-Identifier: Apache-2.0
// Direct light by deterministic stratified shadow rays, kept exact under
// edits: after any of them the sums are those of a computation from scratch, to the bit.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

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

/// What differs from the state of the last compute() or update().
struct Change {
  std::vector<Box> boxes;         ///< RayCaster::object_bounds before and after, of every movable
                                  ///< object that moved, appeared or vanished
  std::vector<uint32_t> lights;   ///< moved, switched on or off, or new
  std::vector<uint32_t> samples;  ///< receivers that changed
};

/// The most that one light counts at one sample, in quanta; reached only next to point lights. The
/// sums of 2048 such lights still fit.
inline constexpr double kMostWeight = 0x1p52;

/// Named arrays for a snapshot.
using Archive = std::map<std::string, std::vector<std::byte>>;

class DirectLight {
 public:
  /// `irradiance_quantum`: irradiance per unit of the sums. Throws OptionError.
  DirectLight(size_t samples, uint32_t group_count, double irradiance_quantum, uint64_t seed);

  /// Everything from scratch. Throws Cancelled (within milliseconds) and leaves the object as it
  /// was; so does update().
  void compute(const Present& present, const Workers& workers, Progress& progress);
  /// Only what `change` concerns: receivers that a changed object's box may part from a light ask
  /// the movables between them again; the static scene is asked for changed lights and samples
  /// only.
  void update(const Present& present, const Change& change, const Workers& workers,
              Progress& progress);

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

  void save(Archive& archive) const;
  /// The state that save() wrote, of the same samples, lights and seed. Throws FormatError.
  void restore(const Archive& archive, std::span<const trace::Light> lights,
               std::span<const uint8_t> sampled);

 private:
  /// Per sample what one light gives. Empty for lights that are not done here.
  struct Column {
    uint32_t group = 0;
    Vec3d channel{};              ///< relative to the strongest
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

  void check(std::span<const trace::Light> lights, std::span<const uint8_t> sampled) const;
  void check(const Present& present) const;
  std::vector<Column> make_columns(std::span<const trace::Light> lights,
                                   std::span<const uint8_t> sampled, size_t first) const;
  void add(const Column& column, size_t sample, int64_t weight, int sign);
  FixedView view_of(const Column& column, size_t sample) const;
  void find_changes(const Present& present, const Change& change, const Workers& workers,
                    Progress& progress, std::vector<Found>& found) const;
  void commit(const std::vector<Found>& found, std::vector<Column> added);

  size_t samples_;
  uint32_t group_count_;
  double quantum_;
  uint64_t seed_;
  std::vector<int64_t> sums_;
  std::vector<Column> columns_;  // per light
  std::vector<PartialView> partial_;
  std::vector<uint32_t> unused_;  // free places of partial_
};

}  // namespace deltalux::direct
