// SPDX-License-Identifier: Apache-2.0
// Finds places by their random key, a hash of point and normal.
#include "session/images/kept_places.h"

#include <numeric>

#include "base/random.h"

namespace deltalux::session {
namespace {

constexpr size_t kBytesOfPlace = 64;  // approximate size of an entry of the hash table

}  // namespace

size_t KeptPlaces::Batch::bytes() const {
  return receivers.size() * (sizeof(direct::Receiver) + kBytesOfPlace + 1) +
         seen.size() * sizeof(gather::SeenTargets) + pilot_guiding.bytes() + guiding.bytes() +
         pilots.bytes() + hits.bytes();
}

uint64_t KeptPlaces::key_of(const direct::Receiver& receiver, uint32_t rays) {
  return combine(receiver.key, rays);
}

KeptPlaces::Place KeptPlaces::find(const direct::Receiver& receiver, uint32_t rays) const {
  const auto found = places_.find(key_of(receiver, rays));
  if (found == places_.end()) return {};
  const Place place = found->second;
  if (place.batch->rays != rays || !(place.batch->receivers[place.number] == receiver)) return {};
  place.batch->used = true;
  return place;
}

void KeptPlaces::keep(std::unique_ptr<Batch> batch) {
  const size_t own = batch->bytes();
  if (own > max_bytes_) return;
  while (own + bytes() > max_bytes_ && !batches_.empty()) {
    forget_places(*batches_.front());
    batches_.pop_front();
  }
  for (uint32_t i = 0; i < batch->receivers.size(); ++i)
    places_[key_of(batch->receivers[i], batch->rays)] = {batch.get(), i};
  batches_.push_back(std::move(batch));
}

void KeptPlaces::keep_direct(std::span<const direct::Receiver> receivers, bool by_need,
                             std::span<const Vec3d> light) {
  if (bytes() > max_bytes_) return;
  for (size_t i = 0; i < receivers.size(); ++i) direct_.keep(receivers[i], by_need, light[i]);
}

void KeptPlaces::note(const gather::Change& change) {
  gather::Change own = change;
  own.samples.clear();
  direct_.note(own.scene);
  if (change_)
    change_->merge(own);
  else
    change_ = std::move(own);
}

size_t KeptPlaces::bytes() const {
  return std::accumulate(batches_.begin(), batches_.end(), direct_.bytes(),
                         [](size_t sum, const auto& batch) { return sum + batch->bytes(); });
}

void KeptPlaces::forget_unused() {
  std::erase_if(batches_, [&](const std::unique_ptr<Batch>& batch) {
    if (!batch->used) forget_places(*batch);
    return !batch->used;
  });
}

void KeptPlaces::forget_places(const Batch& batch) {
  for (const direct::Receiver& receiver : batch.receivers) {
    const auto found = places_.find(key_of(receiver, batch.rays));
    if (found != places_.end() && found->second.batch == &batch) places_.erase(found);
  }
}

}  // namespace deltalux::session
