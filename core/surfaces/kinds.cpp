// SPDX-License-Identifier: Apache-2.0
// The list of all kinds of surfaces.
#include "surfaces/kinds.h"

#include "base/find_named.h"
#include "surfaces/pane.h"

namespace deltalux::surfaces {

// Each is defined in the file of its name; diffuse() is declared with Surface.

namespace {

constexpr const Kind& (*kKinds[])() = {diffuse, pane};

}  // namespace

const Kind& kind_named(std::string_view name) {
  return find_named("kind of surface", kKinds, name);
}

}  // namespace deltalux::surfaces
