// SPDX-License-Identifier: Apache-2.0
// Colour scales: values to colours whose lightness a reader can order, with round ticks.
// The same anchors and rules as python/deltalux/outputs/colour_scale.py; a test holds them together.

import { percentile } from './percentile'

type Anchor = readonly [lightness: number, chroma: number, hueDegrees: number] // OKLCh

export const SEQUENTIAL: readonly Anchor[] = [
  [0.17, 0.08, 300],
  [0.31, 0.15, 292],
  [0.45, 0.15, 262],
  [0.58, 0.11, 215],
  [0.7, 0.14, 158],
  [0.82, 0.18, 118],
  [0.91, 0.17, 100],
  [0.98, 0.06, 100],
]
export const DIVERGING: readonly Anchor[] = [
  [0.94, 0.05, 215],
  [0.75, 0.13, 232],
  [0.51, 0.16, 256],
  [0.25, 0.0, 100],
  [0.52, 0.16, 35],
  [0.76, 0.15, 62],
  [0.95, 0.09, 98],
]
export const TABLE_SIZE = 256
const LOG_BEYOND = 8 // spread of values from which a logarithmic scale reads better
const LEAST_SPREAD = 0.1 // of the largest value: values that differ by less are shown from zero on

/** 256 linear sRGB colours through evenly spaced anchors, as RGBA. */
export function colourTable(anchors: readonly Anchor[]): Float32Array {
  const labs = anchors.map(([lightness, chroma, hue]) => {
    const angle = (hue * Math.PI) / 180
    return [lightness, chroma * Math.cos(angle), chroma * Math.sin(angle)]
  })
  const table = new Float32Array(4 * TABLE_SIZE)
  for (let i = 0; i < TABLE_SIZE; i++) {
    const at = (i / (TABLE_SIZE - 1)) * (labs.length - 1)
    const low = Math.min(Math.floor(at), labs.length - 2)
    const lab = labs[low].map((value, axis) => value + (labs[low + 1][axis] - value) * (at - low))
    table.set([...oklabToLinear(lab), 1], 4 * i)
  }
  return table
}

function oklabToLinear([lightness, a, b]: number[]): number[] {
  const long = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
  const medium = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
  const short = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3
  return [
    4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short,
    -1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short,
    -0.0041960863 * long - 0.7034186147 * medium + 1.707614701 * short,
  ].map((channel) => Math.min(Math.max(channel, 0), 1))
}

export interface ColourScale {
  low: number
  high: number
  logarithmic: boolean
  diverging: boolean
}

/** Place of a value on the scale, 0 to 1 within it. */
export function position(scale: ColourScale, value: number): number {
  if (scale.logarithmic) {
    return Math.log(Math.max(value, 1e-30) / scale.low) / Math.log(scale.high / scale.low)
  }
  return (value - scale.low) / (scale.high - scale.low)
}

/** Some four to nine round values within the scale. */
export function ticks(scale: ColourScale): number[] {
  if (!scale.logarithmic) {
    const step = roundUp((scale.high - scale.low) / 6)
    const first = Math.ceil(scale.low / step - 1e-9)
    const last = Math.floor(scale.high / step + 1e-9)
    return Array.from({ length: last - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)))
  }
  const mantissas = scale.high / scale.low < 1e3 ? [1, 2, 5] : [1]
  const values: number[] = []
  for (let power = Math.floor(Math.log10(scale.low)); power <= Math.ceil(Math.log10(scale.high)); power++) {
    for (const mantissa of mantissas) values.push(Number(`${mantissa}e${power}`))
  }
  return values.filter((v) => v >= scale.low * (1 - 1e-9) && v <= scale.high * (1 + 1e-9))
}

/** Scale for the 2nd to the 98th percentile of non-negative values; logarithmic where they spread, unless told. */
export function scaleFor(values: Float32Array, logarithmic: boolean | null = null): ColourScale {
  const sorted = values.slice().sort()
  const top = percentile(sorted, 0.98)
  if (!(top > 0)) return { low: 0, high: 1, logarithmic: false, diverging: false }
  const high = roundUp(top)
  if (!(logarithmic ?? top / Math.max(percentile(sorted, 0.5), 1e-30) > LOG_BEYOND)) {
    const bottom = percentile(sorted, 0.02)
    if (high - bottom < LEAST_SPREAD * high) return { low: 0, high, logarithmic: false, diverging: false }
    const step = roundUp((high - bottom) / 6)
    const low = Number((Math.floor(bottom / step) * step).toPrecision(12))
    return { low, high, logarithmic: false, diverging: false }
  }
  const positive = sorted.subarray(sorted.findIndex((value) => value > 0))
  const bottom = Math.min(Math.max(percentile(positive, 0.02), high / 1e4), high / 10)
  return { low: roundDown(bottom), high, logarithmic: true, diverging: false }
}

/** Diverging scale around zero for the values that are not zero. */
export function symmetricScale(values: Float32Array): ColourScale {
  const sizes = values
    .filter((value) => value !== 0)
    .map(Math.abs)
    .sort()
  const top = percentile(sizes, 0.98)
  const high = top > 0 ? roundUp(top) : 1
  return { low: -high, high, logarithmic: false, diverging: true }
}

/** The next of 1, 2, 2.5, 5 times a power of ten. */
export function roundUp(value: number): number {
  const power = Math.floor(Math.log10(value))
  const mantissa = [1, 2, 2.5, 5, 10].find((m) => m * 10 ** power >= value * (1 - 1e-9)) ?? 10
  return Number(`${mantissa}e${power}`)
}

/** The last of 1, 2, 2.5, 5 times a power of ten. */
function roundDown(value: number): number {
  const power = Math.floor(Math.log10(value))
  const mantissa = [5, 2.5, 2, 1].find((m) => m * 10 ** power <= value * (1 + 1e-9)) ?? 1
  return Number(`${mantissa}e${power}`)
}
