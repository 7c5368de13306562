// SPDX-License-Identifier: Apache-2.0
// The SIMD twin of crossing.h: the same operations in the same order, for as many lanes as `W` has.
// All are templates of W: where that is local to a file, no instruction set leaks from it.
#pragma once
#include "segments/segment_span.h"

namespace deltalux::estimate {

/// Twin of segment_end().
template <class W>
inline typename W::Floats segment_ends(segments::SegmentEnd rule, typename W::Floats length,
                                       typename W::Floats extended, typename W::Floats radius) {
  if (rule == segments::SegmentEnd::first) return length;
  if (rule == segments::SegmentEnd::second) return extended;
  return W::min(length + W::broadcast(segments::kBoundedRadii) * radius, extended);
}

/// Twin of cross_circle(): one bit for each lane that crosses. Of points and vectors x, y, z.
template <class W>
inline uint32_t cross_circles(const typename W::Floats* o, const typename W::Floats* w,
                              typename W::Floats end, const typename W::Floats* c,
                              const typename W::Floats* n, typename W::Floats radius2) {
  using Floats = typename W::Floats;
  const Floats zero = W::broadcast(0.0f);
  const Floats facing = n[0] * w[0] + n[1] * w[1] + n[2] * w[2];
  const Floats height = n[0] * (c[0] - o[0]) + n[1] * (c[1] - o[1]) + n[2] * (c[2] - o[2]);
  const Floats s = height / facing;
  const Floats px = (o[0] + s * w[0]) - c[0], py = (o[1] + s * w[1]) - c[1],
               pz = (o[2] + s * w[2]) - c[2];
  const Floats distance2 = px * px + py * py + pz * pz;
  return W::mask(W::both(W::both(W::less(facing, zero), W::less(zero, s)),
                         W::both(W::less_equal(s, end), W::less_equal(distance2, radius2))));
}

}  // namespace deltalux::estimate
