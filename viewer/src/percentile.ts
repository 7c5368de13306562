// SPDX-License-Identifier: Apache-2.0
// Percentiles as NumPy computes them.

/** Value below which a share of the ascending values lies, interpolated; 0 where there are none. */
export function percentile(ascending: ArrayLike<number>, share: number): number {
  if (ascending.length === 0) return 0
  const at = share * (ascending.length - 1)
  const low = Math.floor(at)
  const high = Math.min(low + 1, ascending.length - 1)
  return ascending[low] + (ascending[high] - ascending[low]) * (at - low)
}
