// SPDX-License-Identifier: Apache-2.0
// The kinds of lights that there are, by name.
#pragma once
#include <string_view>

#include "lights/kind.h"

namespace deltalux::lights {

/// Throws SceneError where there is none of that name.
const Kind& kind_named(std::string_view name);

}  // namespace deltalux::lights
