// SPDX-License-Identifier: Apache-2.0
// Colours, scales and exposure equal those of deltalux.outputs; the expected numbers were printed by it.
import { describe, expect, it } from 'vitest'
import {
  colourTable,
  DIVERGING,
  position,
  scaleFor,
  SEQUENTIAL,
  symmetricScale,
  ticks,
} from '../src/colourScale'
import { automaticExposure } from '../src/three/meter'

const SPREAD = Float32Array.of(1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 600)
const linear = (low: number, high: number) => ({ low, high, logarithmic: false, diverging: false })

describe('colour tables', () => {
  it.each([
    [SEQUENTIAL, 0, [0.007911, 0.000816, 0.025125]],
    [SEQUENTIAL, 37, [0.037496, 0.006731, 0.175171]],
    [SEQUENTIAL, 128, [0.009592, 0.362045, 0.285609]],
    [SEQUENTIAL, 200, [0.708925, 0.707008, 0.038006]],
    [SEQUENTIAL, 255, [1.0, 0.957931, 0.603419]],
    [DIVERGING, 0, [0.565707, 0.908604, 1.0]],
    [DIVERGING, 64, [0.023183, 0.274822, 0.688657]],
    [DIVERGING, 128, [0.016972, 0.016005, 0.015759]],
    [DIVERGING, 200, [0.750592, 0.207781, 0.032773]],
    [DIVERGING, 255, [0.993127, 0.870105, 0.399212]],
  ])('have the colours of the pictures, at every anchor', (anchors, entry, expected) => {
    const colour = colourTable(anchors).slice(4 * entry, 4 * entry + 3)
    expect([...colour]).toEqual(expected.map((value) => expect.closeTo(value, 5)))
  })
})

describe('scales', () => {
  it('fit the values, logarithmic where they spread', () => {
    expect(scaleFor(SPREAD)).toEqual({ low: 1, high: 500, logarithmic: true, diverging: false })
    expect(scaleFor(SPREAD, false)).toEqual(linear(0, 500))
    expect(scaleFor(Float32Array.of(210, 300, 400, 480))).toEqual(linear(200, 500))
    const dark = scaleFor(Float32Array.of(0, 0, 0, 1, 2, 30, 900))
    expect(dark).toEqual({ low: 1, high: 1000, logarithmic: true, diverging: false })
    expect(scaleFor(Float32Array.of(0, 0))).toEqual(linear(0, 1))
    expect(scaleFor(Float32Array.of(100, 100, 100))).toEqual(linear(0, 100))
    expect(scaleFor(Float32Array.of(100, 100), true)).toEqual({ ...linear(10, 100), logarithmic: true })
  })

  it('are symmetric for changes and do not mind how much stays', () => {
    const changes = new Float32Array(1000)
    changes.set([-1.2, 0.3])
    expect(symmetricScale(changes)).toMatchObject({ low: -2, high: 2, diverging: true })
    expect(symmetricScale(new Float32Array(5))).toMatchObject({ low: -1, high: 1 })
  })

  it('have round ticks', () => {
    expect(ticks(linear(0, 250))).toEqual([0, 50, 100, 150, 200, 250])
    expect(ticks({ low: 1, high: 500, logarithmic: true, diverging: false })).toEqual([
      1, 2, 5, 10, 20, 50, 100, 200, 500,
    ])
    expect(ticks({ low: 1, high: 2000, logarithmic: true, diverging: false })).toEqual([1, 10, 100, 1000])
  })

  it('place values', () => {
    expect(position({ low: 1, high: 2000, logarithmic: true, diverging: false }, 30)).toBeCloseTo(
      0.44747283625,
      10,
    )
    expect(position(linear(-2, 2), 1)).toBe(0.75)
  })
})

describe('automatic exposure', () => {
  it('is that of the pictures', () => {
    expect(automaticExposure([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 1000])).toBeCloseTo(0.05258229973, 10)
    expect(automaticExposure([0, 0])).toBeNull()
  })
})
