// SPDX-License-Identifier: Apache-2.0
// Converts a session's options from Python's names and values.
#pragma once
#include "common.h"
#include "session/state/state.h"

namespace deltalux::python {

/// Options by name, as python/deltalux/session_options.py declares them. Throws OptionError for a
/// name that the core does not have and for one that is missing, type_error for a value of another
/// type.
session::Options to_options(const nb::dict& values);

}  // namespace deltalux::python
