// SPDX-License-Identifier: Apache-2.0
// Another instruction set for the length of a scope.
#pragma once
#include <string>

#include "base/cpu.h"

namespace deltalux {

class WithIsa {
 public:
  explicit WithIsa(Isa isa) : before_(deltalux::isa()) { use_isa(isa); }
  ~WithIsa() { use_isa(before_); }
  WithIsa(const WithIsa&) = delete;
  WithIsa& operator=(const WithIsa&) = delete;

 private:
  const Isa before_;
};

inline std::string name_of(Isa isa) {
  return isa == Isa::portable ? "portable" : isa == Isa::avx2 ? "avx2" : "avx512";
}

}  // namespace deltalux
