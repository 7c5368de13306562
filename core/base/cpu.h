// SPDX-License-Identifier: Apache-2.0
// Which instruction set the loops use that are written for several. All give the same sums.
#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

namespace deltalux {

/// Each processor that has one has those before it, too.
enum class Isa : uint8_t {
  portable,  ///< nothing but standard C++
  avx2,      ///< with FMA
  avx512,    ///< F, BW, DQ and VL
};

/// The best that the processor has, whatever this build is written for.
Isa processor_isa();

/// Those that processor and build have, the best one last.
std::vector<Isa> available_isas();

/// "portable", "avx2" or "avx512". Throws OptionError for others and for what is not available.
Isa isa_named(std::string_view name);

/// The one in use: the best available, or that which the environment's DELTALUX_ISA names when
/// first asked, so that the slower loops can be tried anywhere. Throws OptionError as above.
Isa isa();

/// Uses this one from now on, for tests. Throws OptionError where it is not available.
void use_isa(Isa isa);

}  // namespace deltalux
