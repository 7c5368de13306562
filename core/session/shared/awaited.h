// SPDX-License-Identifier: Apache-2.0
// The samples whose rays a session leaves to others, and which of them are there.
#pragma once
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "base/error.h"

namespace deltalux::session {

class Awaited {
 public:
  Awaited() = default;
  explicit Awaited(size_t samples) : there_(samples), left_(samples) {}
  /// Throws OptionError unless there are samples [first, last), of so many.
  static void check(size_t first, size_t last, size_t samples) {
    if (first <= last && last <= samples) return;
    throw OptionError("rays: found samples " + std::to_string(first) + " to " +
                      std::to_string(last) + ", expected some of " + std::to_string(samples) +
                      "; share rays among sessions of the same samples");
  }
  /// The same where all of them must be missing.
  void check_missing(size_t first, size_t last) const {
    check(first, last, there_.size());
    if (std::find(there_.begin() + long(first), there_.begin() + long(last), 1) !=
        there_.begin() + long(last))
      throw OptionError("rays: found those of samples " + std::to_string(first) + " to " +
                        std::to_string(last) + ", of which some are there; take each range once");
  }
  /// Notes that missing samples are there.
  void take(size_t first, size_t last) {
    std::fill(there_.begin() + long(first), there_.begin() + long(last), uint8_t(1));
    left_ -= last - first;
  }
  bool over() const { return left_ == 0; }

 private:
  std::vector<uint8_t> there_;  // by sample
  size_t left_ = 0;
};

}  // namespace deltalux::session
