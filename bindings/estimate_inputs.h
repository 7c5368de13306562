// SPDX-License-Identifier: Apache-2.0
// Converts a user's segments and discs into the form that estimators need.
#pragma once
#include "common.h"
#include "samples/disc_set.h"
#include "segments/segment_span.h"

namespace deltalux::python {

using segments::SegmentEnd;

inline SegmentEnd to_rule(const std::string& name) {
  return name == "first"    ? SegmentEnd::first
         : name == "second" ? SegmentEnd::second
                            : SegmentEnd::bounded;
}

/// Segments as a structure of arrays, made from a user's rows.
struct SegmentArrays {
  std::vector<float> column[8];
  std::vector<uint32_t> power;
  size_t count() const { return column[0].size(); }
  segments::SegmentSpan span(size_t begin, size_t end) const {
    const auto at = [&](int k) { return column[k].data() + begin; };
    return {end - begin, at(0), at(1), at(2), at(3),
            at(4),       at(5), at(6), at(7), power.data() + 3 * begin,
            nullptr};
  }
};

inline SegmentArrays to_segments(const Rows<float, 3>& origin, const Rows<float, 3>& direction,
                                 const Column<float>& length, const Column<float>& extended,
                                 const Rows<uint32_t, 3>& power) {
  SegmentArrays out;
  const size_t n = origin.shape(0);
  for (int k = 0; k < 3; ++k) {
    out.column[k].resize(n);
    out.column[k + 3].resize(n);
    for (size_t i = 0; i < n; ++i) {
      out.column[k][i] = origin.data()[3 * i + k];
      out.column[k + 3][i] = direction.data()[3 * i + k];
    }
  }
  out.column[6] = to_vector(length);
  out.column[7] = to_vector(extended);
  out.power.assign(power.data(), power.data() + 3 * n);
  return out;
}

inline samples::DiscSet to_discs(const Rows<float, 3>& points, const Rows<float, 3>& normals,
                                 const Column<float>& radius) {
  samples::DiscSet discs;
  discs.centre = to_vectors(points);
  discs.normal = to_vectors(normals);
  for (Vec3f& n : discs.normal) n = normalize(n);
  discs.radius = to_vector(radius);
  discs.outline.assign(discs.size(), samples::kWholeDisc);
  discs.id.resize(discs.size());
  for (uint32_t i = 0; i < discs.size(); ++i) discs.id[i] = i;
  return discs;
}

}  // namespace deltalux::python
