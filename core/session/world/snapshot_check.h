// SPDX-License-Identifier: Apache-2.0
// Checks whether the contents of a session file can be the state of a session. All functions throw
// FormatError.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace deltalux::session::snapshot {

[[noreturn]] void refuse(const std::string& what);
[[noreturn]] void refuse_entry(const char* name, size_t entry, double found, double low,
                               double high);

/// Refuses values outside of [low, high], and NaN.
template <class T>
void check_range(const char* name, const std::vector<T>& values, double low, double high) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!(double(values[i]) >= low && double(values[i]) <= high))
      refuse_entry(name, i, double(values[i]), low, high);
}

/// Checks a quantum of power or irradiance: positive, and coarser than the `chosen` one by no more
/// than edits explain (a factor of 2^20).
void check_quantum(const char* name, double found, double chosen);

/// Checks that static objects have their original pose and presence, and that movable ones have a
/// rigid pose within the world box. All numbers must be finite.
void check_poses(const std::vector<scene::Object>& original, const scene::Scene& scene);

/// Checks that radii equal the `given` ones. Where these are NaN (automatic), a radius must be
/// positive and no larger than the world box, or NaN unless all must be `known`.
void check_radii(std::span<const float> radius, std::span<const float> given, const Box& world,
                 bool known);

/// Checks that the area of each disc is 0, or between 1e-4 and 2 times that of its circle, over its
/// openness.
void check_areas(std::span<const float> area, std::span<const float> radius,
                 std::span<const float> openness);

/// Checks that sums of quanta are neither negative nor larger than `segments` segments can make
/// them.
void check_sums(std::span<const int64_t> sums, size_t segments);

}  // namespace deltalux::session::snapshot
