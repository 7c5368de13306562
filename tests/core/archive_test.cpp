// SPDX-License-Identifier: Apache-2.0
// Arrays in pieces read as if they were whole; wrong sizes are refused before memory is taken.
#include "base/archive.h"

#include <gtest/gtest.h>

#include <numeric>

#include "memory_archive.h"

namespace deltalux {
namespace {

TEST(Archive, ReadsAcrossPieces) {
  std::vector<uint32_t> numbers(100);
  std::iota(numbers.begin(), numbers.end(), 0u);
  ArchiveView view;
  for (const size_t count : {0, 1, 39, 60})
    view.append("numbers", std::span<const uint32_t>(numbers).first(count));
  view.keep("none", std::vector<double>{});
  EXPECT_EQ(view.names(), (std::vector<std::string>{"none", "numbers"}));
  std::vector<uint32_t> whole(numbers.begin(), numbers.begin() + 1);
  whole.insert(whole.end(), numbers.begin(), numbers.begin() + 39);
  whole.insert(whole.end(), numbers.begin(), numbers.begin() + 60);
  ASSERT_EQ(view.bytes("numbers"), 4 * whole.size());
  const auto bytes = std::as_bytes(std::span(whole));
  for (size_t offset = 0; offset <= bytes.size(); offset += 3)
    for (size_t count : {size_t(0), size_t(1), size_t(5), bytes.size() - offset}) {
      std::vector<std::byte> part(std::min(count, bytes.size() - offset));
      view.read("numbers", offset, part);
      EXPECT_TRUE(std::equal(part.begin(), part.end(), bytes.begin() + long(offset)));
    }
  std::byte one;
  EXPECT_THROW(view.read("numbers", bytes.size(), {&one, 1}), OptionError);
  EXPECT_THROW(view.read("numbers", SIZE_MAX, {&one, 1}), OptionError);
  EXPECT_THROW(view.read("other", 0, {&one, 1}), OptionError);
}

TEST(Archive, RefusesWrongSizes) {
  ArchiveView view;
  view.keep("three", std::vector<uint32_t>{1, 2, 3});
  MemoryArchive archive(view);
  EXPECT_EQ(archive.count<uint32_t>("three"), 3u);
  EXPECT_THROW(archive.count<double>("three"), FormatError);
  EXPECT_THROW(archive.count<double>("other"), FormatError);
  // The product with the size of an entry would wrap around to 12.
  EXPECT_THROW(archive.read_all<uint32_t>("three", (size_t(1) << 62) + 3), FormatError);
  EXPECT_THROW(archive.read_all<uint32_t>("three", 2), FormatError);
  EXPECT_EQ(archive.read_all<uint32_t>("three", 3), (std::vector<uint32_t>{1, 2, 3}));
}

}  // namespace
}  // namespace deltalux
