// SPDX-License-Identifier: Apache-2.0
// What the gather rays of an image's places met, kept for the next image: an edit changes little of
// it.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "direct/light_shape.h"
#include "gather/aim/sample_rays.h"
#include "gather/hits/gather_hits.h"
#include "session/images/kept_direct.h"

namespace deltalux::session {

class KeptPlaces {
 public:
  /// Places whose rays were cast together.
  struct Batch {
    uint32_t rays = 0;  ///< the standard number of rays per place
    std::vector<direct::Receiver> receivers;
    /// guides that each place sees; empty if there are no guides
    std::vector<gather::SeenTargets> seen;
    gather::Guiding pilot_guiding, guiding;
    /// `pilots` holds no places if ray counts do not depend on pilot rays.
    gather::GatherHits pilots, hits;
    std::vector<int8_t> doublings;  ///< per place: log2 of its ray count over `rays`
    bool used = true;               ///< all_cast up since the last follow_changes()

    size_t bytes() const;
  };
  /// A place: its batch and its index therein. `batch` is null if nothing is kept for the place.
  struct Place {
    Batch* batch = nullptr;
    uint32_t number = 0;
  };

  explicit KeptPlaces(size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Finds a place that was seen before: the same receiver with the same standard number of rays.
  Place find(const direct::Receiver& receiver, uint32_t rays) const;
  /// Keeps a batch; its places replace equal ones kept before. Drops the oldest batches when the
  /// byte limit is exceeded.
  void keep(std::unique_ptr<Batch> batch);
  /// Direct light of places, kept separately, since many places need only direct light.
  KeptDirect& direct() { return direct_; }
  void keep_direct(std::span<const direct::Receiver> receivers, bool by_need,
                   std::span<const Vec3d> light);
  /// Records an edit, except for what it says about samples.
  void note(const gather::Change& change);
  /// If edits were recorded, calls follow(batch, change) for all batches that were used since the
  /// last call, and drops the other batches.
  template <class Follow>
  void follow_changes(const Follow& follow) {
    if (!change_) return;
    const gather::Change change = *std::exchange(change_, std::nullopt);
    forget_unused();
    for (const std::unique_ptr<Batch>& batch : batches_) {
      follow(*batch, change);
      batch->used = false;
    }
  }
  /// Calls visit(batch) for all batches.
  template <class Visit>
  void each(const Visit& visit) const {
    for (const std::unique_ptr<Batch>& batch : batches_) visit(*batch);
  }
  size_t bytes() const;
  /// Number of places whose gathered light was read from kept batches instead of from new rays.
  uint64_t taken() const { return taken_; }
  void count_taken(size_t places) { taken_ += places; }

 private:
  static uint64_t key_of(const direct::Receiver& receiver, uint32_t rays);
  void forget_unused();
  void forget_places(const Batch& batch);

  size_t max_bytes_;
  uint64_t taken_ = 0;
  KeptDirect direct_;
  std::deque<std::unique_ptr<Batch>> batches_;  // oldest first
  std::unordered_map<uint64_t, Place> places_;
  std::optional<gather::Change> change_;  // all edits since the last image
};

}  // namespace deltalux::session
