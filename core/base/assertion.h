// SPDX-License-Identifier: Apache-2.0
// DELTALUX_ASSERT states what the program relies on. Builds with DELTALUX_ASSERTS check it; others
// do not even evaluate it. What users can get wrong is an exception, see error.h.
#pragma once

#if defined(DELTALUX_ENABLE_ASSERTS)

namespace deltalux {
/// Prints where which condition is false, and ends the process.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line) noexcept;
}  // namespace deltalux

#define DELTALUX_ASSERT(...) \
  ((__VA_ARGS__) ? void(0) : ::deltalux::assertion_failed(#__VA_ARGS__, __FILE__, __LINE__))

#else

#define DELTALUX_ASSERT(...) void(false && (__VA_ARGS__))

#endif
