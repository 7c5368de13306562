// SPDX-License-Identifier: Apache-2.0
// The exceptions of the core; the binding translates each to its Python twin.
#pragma once
#include <stdexcept>
#include <string>

namespace deltalux {

struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The scene's content cannot be used.
struct SceneError : Error {
  using Error::Error;
};
/// An argument is out of range or contradicts another.
struct OptionError : Error {
  using Error::Error;
};
/// A saved state is malformed or foreign.
struct FormatError : Error {
  using Error::Error;
};
/// The caller asked to stop.
struct Cancelled : Error {
  Cancelled() : Error("cancelled") {}
};

}  // namespace deltalux
