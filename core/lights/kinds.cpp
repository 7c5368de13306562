// SPDX-License-Identifier: Apache-2.0
// The list of all kinds of lights.
#include "lights/kinds.h"

#include "base/find_named.h"

namespace deltalux::lights {

// Each is defined in the file of its name.
const Kind& point();
const Kind& spot();
const Kind& sun();

namespace {

constexpr const Kind& (*kKinds[])() = {point, spot, sun};

}  // namespace

const Kind& kind_named(std::string_view name) { return find_named("kind of light", kKinds, name); }

}  // namespace deltalux::lights
