// SPDX-License-Identifier: Apache-2.0
// A session's arrays on their way to a file and back. They are passed in pieces, so that neither
// direction needs memory for a second copy.
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

/// Named arrays, which stay in the memory of their owner. Valid until the owner changes.
class ArchiveView {
 public:
  ArchiveView() = default;
  ArchiveView(ArchiveView&&) = default;

  /// Appends `values`, which are not copied, to array `name`; creates the array if necessary.
  template <class T>
  void append(const std::string& name, std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    append_bytes(name, std::as_bytes(values));
  }
  template <class T>
  void append(const std::string& name, const std::vector<T>& values) {
    append(name, std::span<const T>(values));
  }
  /// The same for temporary values, which this object keeps.
  template <class T>
  void keep(const std::string& name, std::vector<T> values) {
    const auto own = std::make_shared<const std::vector<T>>(std::move(values));
    kept_.push_back(own);
    append(name, *own);
  }

  /// Appends `count` values that `make` returns when they are read, possibly more than once: for
  /// parts of an array that nobody keeps in the file's form.
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
  /// Throws OptionError if there is no such array.
  size_t bytes(const std::string& name) const { return array(name).bytes; }
  /// Copies bytes of array `name`, from byte `offset` on. Throws OptionError beyond its end.
  void read(const std::string& name, size_t offset, std::span<std::byte> to) const;

 private:
  struct Piece {
    size_t bytes = 0;
    std::span<const std::byte> at;
    std::function<std::vector<std::byte>()> make;  // for pieces that are not in memory
  };
  struct Array {
    size_t bytes = 0;
    std::vector<Piece> pieces;
    std::vector<size_t> begin;  // offset of each piece
    mutable size_t made = 0;    // index of the piece in `last`, plus 1; 0: none
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

/// The source from which a session is restored; each array is read sequentially.
class ArchiveSource {
 public:
  virtual ~ArchiveSource() = default;
  /// Length of array `name` in bytes; nullopt if there is none. Must not exceed what can be read.
  virtual std::optional<size_t> bytes(const std::string& name) = 0;
  /// Reads the next bytes of array `name`. Throws FormatError beyond its end.
  virtual void read(const std::string& name, std::span<std::byte> to) = 0;

  /// Throws FormatError unless array `name` has `count` entries of type T. Allocates nothing.
  template <class T>
  void expect(const std::string& name, size_t count) {
    expect_bytes(name, count, sizeof(T));
  }
  /// Number of entries of type T in array `name`. Throws FormatError if there is no such array.
  template <class T>
  size_t count(const std::string& name) {
    return count_of(name, sizeof(T));
  }
  template <class T>
  void read(const std::string& name, std::span<T> to) {
    static_assert(std::is_trivially_copyable_v<T>);
    read(name, std::as_writable_bytes(to));
  }
  /// Reads the whole array, which must have `count` entries.
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
