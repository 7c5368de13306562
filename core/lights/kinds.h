// SPDX-License-Identifier: Apache-2.0
// Finds a kind of light by name.
#pragma once
#include <string_view>

#include "lights/kind.h"

namespace deltalux::lights {

/// Throws SceneError if there is no kind of that name.
const Kind& kind_named(std::string_view name);

}  // namespace deltalux::lights
