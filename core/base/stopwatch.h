// SPDX-License-Identifier: Apache-2.0
// Measures wall-clock time in milliseconds. Time never affects results, except for how much work an
// update leaves for later.
#pragma once
#include <chrono>
#include <utility>

namespace deltalux {

class Stopwatch {
 public:
  /// Since construction.
  double milliseconds() const { return between(start_, Clock::now()); }
  /// Since construction, or since the last lap.
  double lap() {
    const Clock::time_point now = Clock::now();
    return between(std::exchange(lap_, now), now);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double between(Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::milli>(to - from).count();
  }

  Clock::time_point start_ = Clock::now();
  Clock::time_point lap_ = start_;
};

/// Adds the time of a scope to a sum.
class ScopeTime {
 public:
  explicit ScopeTime(double& milliseconds) : sum_(milliseconds) {}
  ~ScopeTime() { sum_ += watch_.milliseconds(); }
  ScopeTime(const ScopeTime&) = delete;
  ScopeTime& operator=(const ScopeTime&) = delete;

 private:
  double& sum_;
  Stopwatch watch_;
};

}  // namespace deltalux
