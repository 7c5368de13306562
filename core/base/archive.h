// SPDX-License-Identifier: Apache-2.0
// A session's arrays on their way to a file and back: in pieces, so that neither way takes memory
// for a second copy of them.
#pragma once
#include <cstddef>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"

namespace deltalux {

/// Named arrays that lie where their owner keeps them. Valid until the owner changes.
class ArchiveView {
 public:
  ArchiveView() = default;
  ArchiveView(ArchiveView&&) = default;

  /// Appends `values`, which stay where they are, to array `name`; makes it where there is none.
  template <class T>
  void append(const std::string& name, std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    append_bytes(name, std::as_bytes(values));
  }
  template <class T>
  void append(const std::string& name, const std::vector<T>& values) {
    append(name, std::span<const T>(values));
  }
  /// The same for values made for the purpose, which are kept here.
  template <class T>
  void keep(const std::string& name, std::vector<T> values) {
    const auto own = std::make_shared<const std::vector<T>>(std::move(values));
    kept_.push_back(own);
    append(name, *own);
  }

  /// Appends `count` values that are made when they are read, more than once perhaps: `make`
  /// returns so many. For a part of an array that no one keeps as a file has it.
  template <class T>
  void make(const std::string& name, size_t count, std::function<std::vector<T>()> make) {
    static_assert(std::is_trivially_copyable_v<T>);
    append_piece(name, {count * sizeof(T), {}, [make = std::move(make)] {
                          const std::vector<T> values = make();
                          const auto bytes = std::as_bytes(std::span(values));
                          return std::vector<std::byte>(bytes.begin(), bytes.end());
                        }});
  }

  std::vector<std::string> names() const;
  /// Throws OptionError where there is no such array.
  size_t bytes(const std::string& name) const { return array(name).bytes; }
  /// Copies the bytes of array `name` from number `offset` on. Throws OptionError beyond its end.
  void read(const std::string& name, size_t offset, std::span<std::byte> to) const;

 private:
  struct Piece {
    size_t bytes = 0;
    std::span<const std::byte> at;
    std::function<std::vector<std::byte>()> make;  // where it lies nowhere
  };
  struct Array {
    size_t bytes = 0;
    std::vector<Piece> pieces;
    std::vector<size_t> begin;  // of each piece
    mutable size_t made = 0;    // number of the piece that `last` holds, and one
    mutable std::vector<std::byte> last;
    std::span<const std::byte> piece(size_t number) const;
  };
  void append_bytes(const std::string& name, std::span<const std::byte> bytes) {
    append_piece(name, {bytes.size(), bytes, {}});
  }
  void append_piece(const std::string& name, Piece piece);
  const Array& array(const std::string& name) const;

  std::map<std::string, Array> arrays_;
  std::vector<std::shared_ptr<const void>> kept_;
};

/// Where a session gets its arrays from, each from its beginning on.
class ArchiveSource {
 public:
  virtual ~ArchiveSource() = default;
  /// Length of array `name`; nullopt where there is none. No longer than what is really there.
  virtual std::optional<size_t> bytes(const std::string& name) = 0;
  /// The next bytes of array `name`. Throws FormatError beyond its end.
  virtual void read(const std::string& name, std::span<std::byte> to) = 0;

  /// Throws FormatError unless array `name` has `count` entries of type T; nothing was allocated.
  template <class T>
  void expect(const std::string& name, size_t count) {
    expect_bytes(name, count, sizeof(T));
  }
  /// Number of entries of type T in array `name`. Throws FormatError where there is none.
  template <class T>
  size_t count(const std::string& name) {
    return count_of(name, sizeof(T));
  }
  template <class T>
  void read(const std::string& name, std::span<T> to) {
    static_assert(std::is_trivially_copyable_v<T>);
    read(name, std::as_writable_bytes(to));
  }
  /// The whole array, which must have `count` entries.
  template <class T>
  std::vector<T> read_all(const std::string& name, size_t count) {
    expect<T>(name, count);
    std::vector<T> out(count);
    read(name, std::span<T>(out));
    return out;
  }

 private:
  void expect_bytes(const std::string& name, size_t count, size_t size);
  size_t count_of(const std::string& name, size_t size);
};

}  // namespace deltalux
