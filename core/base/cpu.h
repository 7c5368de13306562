// SPDX-License-Identifier: Apache-2.0
// Chooses the instruction set of loops that exist for several. All give the same sums.
#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

namespace deltalux {

/// Each processor that has one also has those before it.
enum class Isa : uint8_t {
  portable,  ///< nothing but standard C++
  avx2,      ///< with FMA
  avx512,    ///< F, BW, DQ and VL
};

/// The best instruction set of the processor, regardless of this build.
Isa processor_isa();

/// The instruction sets of both processor and build, the best one last.
std::vector<Isa> available_isas();

/// Converts "portable", "avx2" or "avx512". Throws OptionError for other names and for unavailable
/// sets.
Isa isa_named(std::string_view name);

/// The instruction set in use: the best available one, or the one named by the environment variable
/// DELTALUX_ISA at the first call, so that slower loops can be tested anywhere. Throws OptionError
/// as above.
Isa isa();

/// Switches to another instruction set, for tests. Throws OptionError if it is not available.
void use_isa(Isa isa);

}  // namespace deltalux
