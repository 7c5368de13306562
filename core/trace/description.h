// SPDX-License-Identifier: Apache-2.0
// What the bits of results depend on, besides input and code.
#pragma once
#include <string>

namespace deltalux::trace {

/// Embree's version, the instruction set in use, this library's build, and a fingerprint of the
/// arithmetic: a hash of some thousand hits, visibilities and function values to the last bit.
/// Processors approximate reciprocals, and libraries sines, each in its own way; where fingerprints
/// differ, so do results. The first call takes some milliseconds. Throws Error if Embree cannot be
/// started.
const std::string& description();

}  // namespace deltalux::trace
