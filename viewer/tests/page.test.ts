// SPDX-License-Identifier: Apache-2.0
// Parts of the page that need no browser: links, dimmers, poses between keys, creases, latencies, numbers.
import { Box3, Matrix4, Quaternion, Vector3 } from 'three'
import { describe, expect, it, vi } from 'vitest'
import { number, tick } from '../src/format'
import { lampPlace } from '../src/lampPlace'
import { Latency } from '../src/latency'
import { families, Fader, nameInFamily } from '../src/lights'
import { unreachedText } from '../src/panels/figuresPanel'
import { factorAt, placeOf } from '../src/panels/lightPanel'
import { placeLabels } from '../src/isolineLabels'
import { defaultSettings, fromHash, toHash } from '../src/settings'
import { openEdges } from '../src/three/creases'
import { poseAt } from '../src/timeline'

describe('a link', () => {
  const eye = {
    pose: new Matrix4().setPosition(1, 2, 3).toArray(),
    target: [0, 1.5, 0] as [number, number, number],
    verticalFov: 40,
  }

  it('brings the view back', () => {
    const settings = defaultSettings()
    settings.mode = 'falseColour'
    settings.isolines = true
    settings.textures = false
    settings.reference = 'start'
    settings.automaticExposure = false
    settings.stops = -1.5
    settings.ranges.falseColour = { automatic: false, low: 10, high: 750, logarithmic: true }
    expect(fromHash(toHash(settings, 0.0125, eye))).toEqual({ settings, exposure: 0.0125, eye })
  })

  it('that is broken asks for nothing', () => {
    const nothing = { settings: defaultSettings(), exposure: null, eye: null }
    expect(fromHash('')).toEqual(nothing)
    expect(fromHash('#mode=sepia&exposure=-1&stops=x&eye=1,2&falseColour=5,1,0&error=0,1,1')).toEqual(nothing)
  })
})

describe('a dimmer', () => {
  it.each([false, true])('has a place for each factor (by stops: %s)', (logarithmic) => {
    for (const factor of [0, 0.01, 0.5, 1, 2])
      expect(factorAt(placeOf(factor, logarithmic), logarithmic)).toBeCloseTo(factor, 10)
    expect(placeOf(50, logarithmic)).toBe(1)
  })
})

describe('the time line', () => {
  const turned = new Matrix4().compose(new Vector3(2, 0, 0), new Quaternion(0, 1, 0, 0), new Vector3(1, 1, 1))
  const keys = [
    { seconds: 1, pose: new Matrix4() },
    { seconds: 3, pose: turned },
  ]

  it('rests before the first and after the last key', () => {
    expect(poseAt(keys, 0)).toEqual(keys[0].pose)
    expect(poseAt(keys, 9)).toEqual(turned)
  })

  it('stays rigid in between', () => {
    const pose = poseAt(keys, 2)
    expect(new Vector3().setFromMatrixPosition(pose).x).toBeCloseTo(1, 12)
    expect(pose.determinant()).toBeCloseTo(1, 12)
    expect(Math.abs(pose.elements[2])).toBeCloseTo(1, 12) // a quarter turn about Y
  })
})

describe('creases', () => {
  it('are edges of one triangle', () => {
    const square = openEdges([0, 1, 2, 0, 2, 3], 4)
    const pairs = Array.from({ length: square.length / 2 }, (_, i) => `${square[2 * i]}-${square[2 * i + 1]}`)
    expect(pairs).toEqual(['0-1', '0-3', '1-2', '2-3'])
  })
})

describe('latency', () => {
  it('is counted for each pose once its revision, or a later one, is on the screen', () => {
    vi.spyOn(performance, 'now').mockReturnValue(1000)
    const latency = new Latency()
    latency.accepted(900, 5)
    latency.accepted(950, 6)
    latency.shown(4)
    expect(latency.all).toHaveLength(0)
    latency.shown(5)
    expect(latency.all).toEqual([100])
    latency.shown(7)
    expect(latency.all).toHaveLength(2)
    latency.shown(7)
    expect(latency.all).toHaveLength(2)
  })
})

describe('numbers', () => {
  it('have three digits and a minus sign', () => {
    expect([0, 0.01234, 1.5, 123.4, -98765, 1.5e9].map((v) => number(v))).toEqual([
      '0',
      '0.0123',
      '1.50',
      '123',
      '−98765',
      '1.50e+9',
    ])
    expect([tick(0.5, true), tick(-20), tick(0.1 + 0.2)]).toEqual(['+0.5', '−20', '0.3'])
  })

  it('of samples that no path reached are in words', () => {
    expect(unreachedText(1)).toBe('1 sample that no path reached')
    expect(unreachedText(12)).toBe('12 samples that no path reached')
  })
})

describe('numbers on isolines', () => {
  const picture = (value: (x: number) => number, distance: (x: number) => number) => {
    const [width, height] = [64, 24]
    const pixels = new Float32Array(4 * width * height)
    for (let i = 0; i < width * height; i++) pixels.set([value(i % width), 1, distance(i % width), 1], 4 * i)
    return { width, height, pixels }
  }

  it('stand where the values pass a tick, one for a line', () => {
    const labels = placeLabels(
      picture(
        (x) => 10 * x,
        () => 5,
      ),
      [205, 405],
      4,
    )
    expect(labels.map(({ value, x }) => [value, x]).sort()).toEqual([
      [205, 82],
      [405, 162],
    ])
  })

  it('do not stand under what lies over the picture', () => {
    const ramp = picture(
      (x) => 10 * x,
      () => 5,
    )
    const legend = { left: 110, top: 0, right: 130, bottom: 4000 }
    const places = (over: (typeof legend)[]) => placeLabels(ramp, [205, 405], 4, over).map(({ x }) => x)
    expect(places([legend]).sort()).toEqual([162, 82].sort())
    expect(places([{ ...legend, right: 150 }])).toEqual([82])
    expect(places([{ ...legend, bottom: -100 }])).toHaveLength(2)
  })

  it('do not stand where one surface ends before another', () => {
    const edge = picture(
      (x) => (x < 32 ? 100 : 300),
      (x) => (x < 32 ? 5 : 9),
    )
    expect(placeLabels(edge, [205], 4)).toEqual([])
  })
})

describe('an added lamp', () => {
  const room = new Box3(new Vector3(-2, 0, -2), new Vector3(2, 3, 2))
  const inside = (height: number) => (from: Vector3, way: Vector3) => (way.y > 0 ? height - from.y : from.y)

  it('hangs below the ceiling on the way to what is seen', () => {
    const place = lampPlace(new Vector3(-1, 1.5, 0), new Vector3(1, 0, 0), room, inside(3))
    expect(place.toArray()).toEqual([expect.closeTo(0.2), 2.5, 0])
    expect(lampPlace(new Vector3(-1, 0.2, 0), new Vector3(1, 0, 0), room, inside(0.5)).y).toBeCloseTo(0.4)
  })

  it('is within the bounds, seen from outside, under the sky and towards nothing', () => {
    const sky = () => Infinity
    expect(lampPlace(new Vector3(0, 1, 30), new Vector3(0, 1, -2), room, sky).toArray()).toEqual([
      0,
      2.5,
      expect.closeTo(1.92),
    ])
    expect(lampPlace(new Vector3(0, 1, 30), null, room, sky).toArray()).toEqual([0, 2.5, 0])
  })
})

describe('light groups', () => {
  it('are folded by what stands before a separator or a number', () => {
    const names = ['Hall / desk', 'Spot.001', 'hall lamp', 'Spot 2', 'Hall / wall', '7']
    expect([...families(names)]).toEqual([
      ['Hall', ['Hall / desk', 'Hall / wall']],
      ['Spot', ['Spot.001', 'Spot 2']],
      ['hall lamp', ['hall lamp']],
      ['7', ['7']],
    ])
  })

  it('are called by the rest of their names among their family', () => {
    expect(['Hall / desk', 'Spot.001', 'a: b / c'].map(nameInFamily)).toEqual(['desk', 'Spot.001', 'b / c'])
  })

  it('keep their proportions on one fader, also through zero', () => {
    const factors = new Map([
      ['a', 1],
      ['b', 0.5],
    ])
    const fader = new Fader(['a', 'b'], factors)
    const to = (level: number) => {
      const wanted = fader.at(level)
      for (const [name, factor] of Object.entries(wanted)) factors.set(name, factor)
      return wanted
    }
    expect(to(0.5)).toEqual({ a: 0.5, b: 0.25 })
    expect(to(0)).toEqual({ a: 0, b: 0 })
    factors.set('a', 0.3) // by its own dimmer
    expect(to(2)).toEqual({ a: 0.6, b: 1 })
    expect(to(1)).toEqual({ a: 0.3, b: 0.5 })
  })
})
