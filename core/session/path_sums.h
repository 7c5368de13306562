// SPDX-License-Identifier: Apache-2.0
// What the paths of a session bring, as integers: those of ranges that share no path add up to
// those of all their paths.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace deltalux::session {

/// Sums in quanta. After an edit, the difference to the sums before may be added in their place.
struct PathSums {
  uint64_t paths = 0;  ///< number of paths that they are of
  /// [((group * kBatches + batch) * samples + sample) * 3 + channel], samples as given by the user
  std::vector<int64_t> discs;
  std::vector<int64_t> cells;  ///< as gather::CellSums; empty without a final gather
};

/// What gradients are made of, samples as given by the user: sums of the paths on discs, three per
/// slab and sample, and their first moments, six, see estimate::EnergySums.
struct SlopeSums {
  std::vector<int64_t> discs, moments;
};

/// A hash of stored segments as a set: `count` and hashes of sets without common segments add up,
/// modulo 2^64.
struct SegmentsHash {
  uint64_t count = 0, a = 0, b = 0;
};

/// What the first flights from each light bring to the cells, for the lights that gather rays may
/// ask for, see Session::look().
struct FirstFlights {
  std::vector<uint32_t> lights;  ///< ascending
  std::vector<int64_t> quanta;   ///< [((light * cells + cell) * kBatches + batch) * 3 + channel]

  /// The quanta of one light; empty if it is not among `lights`.
  std::span<const int64_t> of(uint32_t light) const {
    const auto found = std::find(lights.begin(), lights.end(), light);
    if (found == lights.end()) return {};
    const size_t each = quanta.size() / lights.size();
    return std::span(quanta).subspan(size_t(found - lights.begin()) * each, each);
  }
};

/// Sums of `width` numbers for each slab and sample: from the order of State::samples into that in
/// which the user gave the samples. `given`: State::given.
std::vector<int64_t> in_given_order(std::span<const int64_t> own, size_t width,
                                    std::span<const uint32_t> given);
/// Adds sums in the user's order to sums in the order of State::samples.
void add_in_given_order(std::span<const int64_t> sums, size_t width,
                        std::span<const uint32_t> given, std::span<int64_t> own);

}  // namespace deltalux::session
