// SPDX-License-Identifier: Apache-2.0
// An archive in memory, for tests: copies of a session's arrays, which may be damaged on purpose.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "base/archive.h"

namespace deltalux {

class MemoryArchive : public ArchiveSource {
 public:
  explicit MemoryArchive(const ArchiveView& view) {
    for (const std::string& name : view.names()) {
      arrays[name].resize(view.bytes(name));
      view.read(name, 0, arrays[name]);
    }
  }
  MemoryArchive(const MemoryArchive& other) : arrays(other.arrays) {}

  std::optional<size_t> bytes(const std::string& name) override {
    const auto entry = arrays.find(name);
    return entry == arrays.end() ? std::nullopt : std::optional(entry->second.size());
  }
  using ArchiveSource::read;
  void read(const std::string& name, std::span<std::byte> to) override {
    const std::vector<std::byte>& from = arrays.at(name);
    size_t& begin = read_[name];
    if (to.size() > from.size() - begin) throw FormatError("too short");
    std::copy_n(from.begin() + long(begin), to.size(), to.begin());
    begin += to.size();
  }

  std::map<std::string, std::vector<std::byte>> arrays;

 private:
  std::map<std::string, size_t> read_;
};

}  // namespace deltalux
