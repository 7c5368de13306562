// SPDX-License-Identifier: Apache-2.0
// The list of all kinds of lights.
#include "lights/kinds.h"

#include <string>

#include "base/error.h"

namespace deltalux::lights {

// Each is defined in the file of its name.
const Kind& point();
const Kind& spot();
const Kind& sun();

namespace {

using Get = const Kind& (*)();
constexpr Get kKinds[] = {point, spot, sun};

}  // namespace

const Kind& kind_named(std::string_view name) {
  std::string known;
  for (const Get kind : kKinds) {
    if (kind().name() == name) return kind();
    known += (known.empty() ? "\"" : ", \"") + std::string(kind().name()) + '"';
  }
  throw SceneError("kind of light: found \"" + std::string(name) + "\", expected one of " + known);
}

}  // namespace deltalux::lights
