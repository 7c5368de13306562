// SPDX-License-Identifier: Apache-2.0
// Reads arrays across their pieces, and checks sizes before anything is allocated.
#include "base/archive.h"

#include <algorithm>

namespace deltalux {

std::vector<std::string> ArchiveView::names() const {
  std::vector<std::string> names;
  for (const auto& [name, array] : arrays_) names.push_back(name);
  return names;
}

void ArchiveView::append_piece(const std::string& name, Piece piece) {
  Array& array = arrays_[name];
  if (piece.bytes == 0) return;
  array.begin.push_back(array.bytes);
  array.bytes += piece.bytes;
  array.pieces.push_back(std::move(piece));
}

std::span<const std::byte> ArchiveView::Array::piece(size_t number) const {
  const Piece& own = pieces[number];
  if (!own.make) return own.at;
  if (made != number + 1) {
    made = 0;
    last = own.make();
    if (last.size() != own.bytes) throw Error("archive: a piece has another size than was told");
    made = number + 1;
  }
  return last;
}

const ArchiveView::Array& ArchiveView::array(const std::string& name) const {
  const auto entry = arrays_.find(name);
  if (entry == arrays_.end()) throw OptionError("archive: no array \"" + name + "\"");
  return entry->second;
}

void ArchiveView::read(const std::string& name, size_t offset, std::span<std::byte> to) const {
  const Array& from = array(name);
  if (offset > from.bytes || to.size() > from.bytes - offset)
    throw OptionError("archive: array \"" + name + "\" is shorter than that");
  if (to.empty()) return;
  size_t piece =
      size_t(std::upper_bound(from.begin.begin(), from.begin.end(), offset) - from.begin.begin()) -
      1;
  size_t skip = offset - from.begin[piece];
  for (; !to.empty(); ++piece, skip = 0) {
    const std::span<const std::byte> rest = from.piece(piece).subspan(skip);
    const size_t count = std::min(rest.size(), to.size());
    std::memcpy(to.data(), rest.data(), count);
    to = to.subspan(count);
  }
}

void ArchiveSource::expect_bytes(const std::string& name, size_t count, size_t size) {
  const std::optional<size_t> found = bytes(name);
  if (!found) throw FormatError("session file: \"" + name + "\" is missing");
  if (*found % size || *found / size != count)
    throw FormatError("session file: \"" + name + "\" holds " + std::to_string(*found) +
                      " bytes, expected " + std::to_string(count) + " entries of " +
                      std::to_string(size));
}

size_t ArchiveSource::count_of(const std::string& name, size_t size) {
  const size_t found = bytes(name).value_or(0);
  expect_bytes(name, found / size, size);
  return found / size;
}

}  // namespace deltalux
