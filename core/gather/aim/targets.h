// SPDX-License-Identifier: Apache-2.0
// All that gather rays are aimed at: squares of guides, then beams.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "gather/aim/beams.h"
#include "gather/aim/guide.h"

namespace deltalux::gather {

inline constexpr size_t kMaxTargets = kMaxGuides + kMaxBeams;

/// The targets of a scene, by index; what all squares are asked for is computed for many at once.
class Targets {
 public:
  /// Keeps references to the guides and beams.
  Targets(std::span<const Guide> guides, const Beams& beams);
  Targets(const Targets&) = delete;  // it points to its own squares
  Targets& operator=(const Targets&) = delete;

  size_t size() const { return all_.size(); }
  const Target& operator[](size_t i) const { return *all_[i]; }
  /// The number by which allotments and files name a target.
  static constexpr uint16_t kFirstBeam = kMaxGuides;
  uint16_t number(size_t i) const {
    return uint16_t(i < squares_.size() ? i : kFirstBeam + (i - squares_.size()));
  }
  const Target& numbered(uint16_t number) const {
    return *all_[number < kFirstBeam ? number : squares_.size() + (number - kFirstBeam)];
  }
  /// Whether there is a target of that number among so many.
  static bool has(uint16_t number, size_t guides, size_t beams) {
    return number < kFirstBeam ? number < guides : size_t(number - kFirstBeam) < beams;
  }

  using Values = std::array<float, kMaxTargets>;
  /// Target::share() of each.
  void shares(Vec3f from, Vec3f n, Values& out) const;
  /// For each: 0 only where Target::density() is 0 in this direction.
  void may_be_dense(Vec3f from, Vec3f w, Values& out) const;

 private:
  std::vector<Square> squares_;
  std::vector<const Target*> all_;
  size_t padded_;  // a multiple of the lanes of a vector; those beyond the squares bring nothing
  GuideSquares<kMaxGuides> columns_;
  // by square: irradiance if it filled the view, relative to its surroundings
  alignas(64) std::array<float, kMaxGuides> brought_{};
};

}  // namespace deltalux::gather
