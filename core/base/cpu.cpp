// SPDX-License-Identifier: Apache-2.0
// Queries the processor and the environment once.
#include "base/cpu.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <string>

#include "base/error.h"

namespace deltalux {
namespace {

constexpr const char* kNames[] = {"portable", "avx2", "avx512"};
constexpr int kUndecided = -1;
std::atomic<int> in_use = kUndecided;

bool in_build(Isa isa) {
  switch (isa) {
    case Isa::portable:
      return true;
    case Isa::avx2:  // see estimate/lanes.h
#if defined(__AVX2__) && defined(__FMA__)
      return true;
#else
      return false;
#endif
    case Isa::avx512:  // files of their own in every build
#if defined(__x86_64__)
      return true;
#else
      return false;
#endif
  }
  return false;
}

}  // namespace

Isa processor_isa() {
#if defined(__x86_64__)
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return Isa::portable;
  const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                    __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  return wide ? Isa::avx512 : Isa::avx2;
#else
  return Isa::portable;
#endif
}

std::vector<Isa> available_isas() {
  std::vector<Isa> out;
  for (const Isa isa : {Isa::portable, Isa::avx2, Isa::avx512})
    if (isa <= processor_isa() && in_build(isa)) out.push_back(isa);
  return out;
}

Isa isa_named(std::string_view name) {
  std::string expected;
  for (const Isa isa : available_isas()) {
    if (name == kNames[size_t(isa)]) return isa;
    expected += (expected.empty() ? "\"" : ", \"") + std::string(kNames[size_t(isa)]) + '"';
  }
  throw OptionError("DELTALUX_ISA: found \"" + std::string(name) + "\", expected " + expected +
                    " (what this processor and this build have); unset it for the best");
}

Isa isa() {
  const int known = in_use.load(std::memory_order_relaxed);
  if (known != kUndecided) return Isa(known);
  const char* name = std::getenv("DELTALUX_ISA");
  use_isa(name && *name ? isa_named(name) : available_isas().back());
  return Isa(in_use.load());
}

void use_isa(Isa isa) { in_use = int(isa_named(kNames[size_t(isa)])); }

}  // namespace deltalux
