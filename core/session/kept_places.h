// SPDX-License-Identifier: Apache-2.0
// What the places of a picture saw, kept for the next one: an edit changes little of it.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "direct/light_shape.h"
#include "gather/looks.h"
#include "gather/sample_rays.h"
#include "session/kept_direct.h"

namespace deltalux::session {

class KeptPlaces {
 public:
  /// Places that were looked at together.
  struct Batch {
    uint32_t rays = 0;  ///< the standard number
    std::vector<direct::Receiver> receivers;
    std::vector<gather::SeenGuides> seen;  ///< empty without guides
    gather::Guiding pilot_guiding, guiding;
    gather::Looks pilots,
        looks;  ///< pilots without places where no number of rays follows from them
    std::vector<int8_t> doublings;  ///< of `rays`, per place
    bool used = true;               ///< since follow_changes()

    size_t bytes() const;
  };
  /// A place within a batch; `batch` is null where none is kept.
  struct Place {
    Batch* batch = nullptr;
    uint32_t number = 0;
  };

  explicit KeptPlaces(size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Of a place that looks as it did: the same receiver, told the same number of rays.
  Place find(const direct::Receiver& receiver, uint32_t rays) const;
  /// Its places take those over that are the same; the oldest batches go where bytes run out.
  void keep(std::unique_ptr<Batch> batch);
  /// Their light from lamps, which is kept by itself: far more places are asked for it alone.
  KeptDirect& direct() { return direct_; }
  void keep_direct(std::span<const direct::Receiver> receivers, bool by_need,
                   std::span<const Vec3d> light);
  /// Notes an edit. What it says of samples is left out.
  void note(const gather::Change& change);
  /// Calls follow(batch, change) for all that were used since the last time, if there was an edit;
  /// forgets the rest.
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
  /// Calls visit(batch) for all.
  template <class Visit>
  void each(const Visit& visit) const {
    for (const std::unique_ptr<Batch>& batch : batches_) visit(*batch);
  }
  size_t bytes() const;
  /// Places whose light along rays was had from what is kept.
  uint64_t taken() const { return taken_; }
  void count_taken(size_t places) { taken_ += places; }

 private:
  static uint64_t key_of(const direct::Receiver& receiver, uint32_t rays);
  void forget_unused();
  void forget_places(const Batch& batch);

  size_t max_bytes_;
  uint64_t taken_ = 0;
  KeptDirect direct_;
  std::deque<std::unique_ptr<Batch>> batches_;  // the oldest first
  std::unordered_map<uint64_t, Place> places_;
  std::optional<gather::Change> change_;  // since the last picture
};

}  // namespace deltalux::session
