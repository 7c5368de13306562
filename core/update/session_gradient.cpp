// SPDX-License-Identifier: Apache-2.0
// Placeholder compiled until the moments pass lands.
#include "base/error.h"
#include "update/session.h"

namespace deltalux::update {
void Session::read_gradient(double*, Progress&) { throw Error("gradient: not available yet"); }
}  // namespace deltalux::update
