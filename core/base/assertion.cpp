// SPDX-License-Identifier: Apache-2.0
// The only file of the core that prints: what is wrong is the program itself, and it ends.
#include "base/assertion.h"

#include <cstdio>
#include <cstdlib>

#if defined(DELTALUX_ENABLE_ASSERTS)

namespace deltalux {

void assertion_failed(const char* condition, const char* file, int line) noexcept {
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace deltalux

#endif
