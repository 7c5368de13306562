// SPDX-License-Identifier: Apache-2.0
// Progress and cancellation of long calls: worker threads write, the calling thread reads.
#pragma once
#include <atomic>
#include <cstddef>

#include "base/error.h"
#include "base/fault.h"

namespace deltalux {

/// Thread-safe. A stage is a string literal; its fraction is done/total.
class Progress {
 public:
  Progress() : Progress(nullptr) {}
  /// `whole`: a longer stage that this is a part of, which shows nothing of it but cancels it.
  explicit Progress(const Progress* whole) : whole_(whole) {}
  void begin(const char* stage, size_t total) {
    announce(stage, total);
    check();
  }
  /// The same for work that can no longer be cancelled at its start.
  void announce(const char* stage, size_t total) {
    done_.store(0, std::memory_order_relaxed);
    total_.store(total ? total : 1, std::memory_order_relaxed);
    stage_.store(stage, std::memory_order_release);
  }
  void advance(size_t by) { done_.fetch_add(by, std::memory_order_relaxed); }
  /// Throws Cancelled once cancel() was called; workers call it every few milliseconds.
  void check() const {
    if (cancelled() || fault::due(fault::Kind::cancel)) throw Cancelled();
  }
  void cancel() { cancel_.store(true, std::memory_order_relaxed); }
  bool cancelled() const {
    return cancel_.load(std::memory_order_relaxed) || (whole_ && whole_->cancelled());
  }
  const char* stage() const { return stage_.load(std::memory_order_acquire); }
  double fraction() const {
    const double f = double(done_.load(std::memory_order_relaxed)) /
                     double(total_.load(std::memory_order_relaxed));
    return f < 1.0 ? f : 1.0;
  }

 private:
  const Progress* whole_;
  std::atomic<const char*> stage_{""};
  std::atomic<size_t> done_{0}, total_{1};
  std::atomic<bool> cancel_{false};
};

}  // namespace deltalux
