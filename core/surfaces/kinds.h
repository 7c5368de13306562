// SPDX-License-Identifier: Apache-2.0
// Finds a kind of surface by name.
#pragma once
#include <string_view>

#include "surfaces/kind.h"

namespace deltalux::surfaces {

/// Throws SceneError if there is no kind of that name.
const Kind& kind_named(std::string_view name);

}  // namespace deltalux::surfaces
