// SPDX-License-Identifier: Apache-2.0
// What a session is asked for, and the numbers that all its layers share.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "plan/planner.h"
#include "samples/disc_area.h"
#include "segments/segment_store.h"
#include "session/world/held_paths.h"

namespace deltalux::session {

// independent estimates, whose spread gives the standard error
inline constexpr uint32_t kBatches = 8;
inline constexpr uint32_t kMaxOwnGroups = 8;  // later light groups share the last one's sums
// PathLayer::cut of a path that is not to be traced again.
inline constexpr uint16_t kNotCut = 0xffff;
// number of updates expected of a session with movables
inline constexpr double kExpectedFrames = 100;
// Paths traced per step of a bake; every batch contributes its share to each step.
inline constexpr uint64_t kPathsPerStep = 32768;
// Paths replaced between two checks of the clock and of the cancel flag.
inline constexpr size_t kMaxPerStep = 8192;

// scene metres: how far above a surface a point or a sample may lie that belongs to it
inline constexpr float kUnder = 1e-3f;

using plan::Method;

enum class DirectMode : uint8_t { automatic, paths, sampled };

struct Options {
  uint64_t paths = 1'000'000;
  uint64_t seed = 1;
  int threads = 0;
  segments::SegmentEnd segment_end = segments::SegmentEnd::first;
  samples::DiscArea disc_area = samples::DiscArea::reachable;
  DirectMode direct = DirectMode::automatic;
  Method static_method = Method::automatic, moving_method = Method::automatic;
  plan::Policy policy = plan::Policy::measured;
  plan::Machine machine = plan::typical_machine();
  /// Number of updates that the choice of methods assumes.
  double expected_frames = kExpectedFrames;
  /// Plan as if estimators were built anew in every frame.
  bool rebuilds = false;
  uint32_t max_bounces = 1000;
  size_t memory_limit = 0;  ///< bytes, 0 = none
  /// Gather rays per sample; 0: no final gather, discs count all light.
  uint32_t gather_rays = 0;
  /// The paths that the session traces and stores; nullopt: all. Whatever a bake chooses from data
  /// (path counts of lights, quanta, radii, which lights get shadow rays) is that of all paths.
  std::optional<PathRange> range;
};

/// For messages about memory.
inline std::string mebibytes(double bytes) {
  return std::to_string(uint64_t(bytes) >> 20) + " MiB";
}

}  // namespace deltalux::session
