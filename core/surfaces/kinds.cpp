// SPDX-License-Identifier: Apache-2.0
// The list of all kinds of surfaces.
#include "surfaces/kinds.h"

#include <string>

#include "base/error.h"

namespace deltalux::surfaces {

// Each is defined in the file of its name; diffuse() is declared with Surface.

namespace {

using Get = const Kind& (*)();
constexpr Get kKinds[] = {diffuse};

}  // namespace

const Kind& kind_named(std::string_view name) {
  std::string known;
  for (const Get kind : kKinds) {
    if (kind().name() == name) return kind();
    known += (known.empty() ? "\"" : ", \"") + std::string(kind().name()) + '"';
  }
  throw SceneError("kind of surface: found \"" + std::string(name) + "\", expected one of " +
                   known);
}

}  // namespace deltalux::surfaces
