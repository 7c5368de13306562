// SPDX-License-Identifier: Apache-2.0
// A vector that grows by chunks: nothing is copied, and at most one chunk is partly unused.
#pragma once
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "base/assertion.h"

namespace deltalux {

template <class T>
class Chunks {
 public:
  static constexpr size_t kChunk = size_t(1) << 14;  ///< contiguous elements

  Chunks() = default;
  Chunks(Chunks&& other) noexcept
      : pieces_(std::move(other.pieces_)), size_(std::exchange(other.size_, 0)) {}
  Chunks& operator=(Chunks&& other) noexcept {
    pieces_ = std::move(other.pieces_);
    size_ = std::exchange(other.size_, 0);
    return *this;
  }

  size_t size() const { return size_; }
  T& operator[](size_t i) {
    DELTALUX_ASSERT(i < size_);
    return pieces_[i / kChunk][i % kChunk];
  }
  const T& operator[](size_t i) const {
    DELTALUX_ASSERT(i < size_);
    return pieces_[i / kChunk][i % kChunk];
  }
  /// Appends `count` default-constructed elements.
  void grow(size_t count) {
    while (pieces_.size() * kChunk < size_ + count)
      pieces_.push_back(std::make_unique<T[]>(kChunk));
    size_ += count;
  }
  void clear() {
    pieces_.clear();
    size_ = 0;
  }
  size_t bytes() const { return pieces_.size() * kChunk * sizeof(T); }

 private:
  std::vector<std::unique_ptr<T[]>> pieces_;
  size_t size_ = 0;
};

}  // namespace deltalux
