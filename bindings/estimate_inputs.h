// SPDX-License-Identifier: Apache-2.0
// Converts a user's segments and discs into the form that estimators need.
#pragma once
#include "common.h"
#include "samples/disc_set.h"
#include "segments/segment_columns.h"

namespace deltalux::python {

using segments::SegmentColumns;
using segments::SegmentEnd;

inline SegmentEnd to_rule(const std::string& name) {
  return name == "first"    ? SegmentEnd::first
         : name == "second" ? SegmentEnd::second
                            : SegmentEnd::bounded;
}

/// Segments as columns, made from a user's rows.
inline SegmentColumns to_segments(const Rows<float, 3>& origin, const Rows<float, 3>& direction,
                                  const Column<float>& length, const Column<float>& extended,
                                  const Rows<uint32_t, 3>& power) {
  SegmentColumns out;
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
