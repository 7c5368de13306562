// SPDX-License-Identifier: Apache-2.0
// The core's exceptions; the bindings translate each to its Python equivalent.
#pragma once
#include <stdexcept>
#include <string>

namespace deltalux {

struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The scene's contents cannot be used.
struct SceneError : Error {
  using Error::Error;
};
/// An argument is out of range or contradicts another.
struct OptionError : Error {
  using Error::Error;
};
/// A saved state is malformed, or belongs to something else.
struct FormatError : Error {
  using Error::Error;
};
/// The caller cancelled the operation.
struct Cancelled : Error {
  Cancelled() : Error("cancelled") {}
};

}  // namespace deltalux
