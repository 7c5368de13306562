// SPDX-License-Identifier: Apache-2.0
// Finds one of several kinds by its name.
#pragma once
#include <string>
#include <string_view>

#include "base/error.h"

namespace deltalux {

/// The kind of that name among those that the functions `kinds` return. Throws SceneError, which
/// lists all names, if there is none; `what` begins its message.
template <class Kind, size_t N>
const Kind& find_named(std::string_view what, const Kind& (*const (&kinds)[N])(),
                       std::string_view name) {
  std::string known;
  for (const auto kind : kinds) {
    if (kind().name() == name) return kind();
    known += (known.empty() ? "\"" : ", \"") + std::string(kind().name()) + '"';
  }
  throw SceneError(std::string(what) + ": found \"" + std::string(name) + "\", expected one of " +
                   known);
}

}  // namespace deltalux
