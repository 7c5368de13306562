// SPDX-License-Identifier: Apache-2.0
// Another refinement of the mesh: earlier light goes along, frames wait for the mesh that they belong to.
import { DataUtils, Matrix4 } from 'three'
import { describe, expect, it } from 'vitest'
import { Carrier } from '../src/carrier'
import type { GeometryArrays } from '../src/geometry'
import type { Rgb, ValuesFrame } from '../src/protocol'
import { Gone, Remeshing, type Loaded } from '../src/remeshing'
import { isUnknown } from '../src/values'
import { VersionCarrier } from '../src/versionCarrier'

const half = DataUtils.toHalfFloat

/** Two meshes, of a triangle each; those of the first are followed by vertices that refine it. */
function refined(detail: [x: number, weights: number[]][]) {
  const count = 6 + detail.length
  const first = 3 + detail.length
  const points = new Float32Array(3 * count)
  const normals = new Float32Array(3 * count).fill(1)
  const corners = [0, 1, 2, ...detail.map(([x]) => x), 0, 1, 2]
  corners.forEach((x, i) => (points[3 * i] = x))
  const info = {
    vertices: count,
    bounds: [
      [0, 0, 0],
      [2, 1, 1],
    ] as [Rgb, Rgb],
    meshes: [
      { name: 'floor', movable: false, closed: false, first_vertex: 0, vertex_count: first },
      { name: 'chair', movable: true, closed: false, first_vertex: first, vertex_count: 3 },
    ],
  }
  const arrays: GeometryArrays = {
    points,
    normals,
    indices: new Uint32Array(),
    coordinates: new Float32Array(),
    copies: new Uint32Array(),
    detail: Uint32Array.from(detail, (_, i) => 3 + i),
    detailCorners: Uint32Array.from(detail.flatMap(() => [0, 1, 2])),
    detailWeights: Float32Array.from(detail.flatMap(([, weights]) => weights)),
  }
  return [info, arrays] as [typeof info, GeometryArrays]
}

describe('values of another refinement', () => {
  it('are the same bits where a vertex was there, and else lie between those around', () => {
    const before = refined([
      [0.25, [0.75, 0.25, 0]],
      [0.5, [0.5, 0.5, 0]],
    ])
    const now = refined([
      [0.5, [0.5, 0.5, 0]],
      [1.5, [0, 0.5, 0.5]],
      [1.75, [0, 0.25, 0.75]],
    ])
    const halves = new Uint16Array(4 * 8)
    const light = [10, 20, 40, 1, 777, 50, 60, 70]
    light.forEach((value, i) => halves.fill(half(value), 4 * i, 4 * i + 4))
    const carried = new Carrier(before, now).carry({ halves, scale: 2 })
    expect(carried.scale).toBe(2)
    expect([...carried.halves].filter((_, i) => i % 4 === 3).map(DataUtils.fromHalfFloat)).toEqual([
      10, 20, 40, 777, 30, 35, 50, 60, 70,
    ])
  })

  it('are repeated at seams of textures, which other triangles may have in other places', () => {
    const before = refined([
      [0, [1, 0, 0]],
      [0.5, [0.5, 0.5, 0]],
    ])
    const now = refined([
      [0.5, [0.5, 0.5, 0]],
      [0.5, [0.5, 0.5, 0]],
      [1.5, [0, 0.5, 0.5]],
      [1.5, [0, 0.5, 0.5]],
    ])
    before[1].copies = Uint32Array.of(3) // of the last corner
    before[1].detail = Uint32Array.of(4)
    before[1].points[9] = before[1].points[6]
    now[1].copies = Uint32Array.of(4, 6, 9)
    const halves = new Uint16Array(4 * 8)
    const light = [10, 20, 40, 40, 777, 50, 60, 70]
    light.forEach((value, i) => halves.fill(half(value), 4 * i, 4 * i + 4))
    const { halves: carried } = new Carrier(before, now).carry({ halves, scale: 2 })
    expect([...carried].filter((_, i) => i % 4 === 0).map(DataUtils.fromHalfFloat)).toEqual([
      10, 20, 40, 777, 777, 30, 30, 50, 60, 60,
    ])
  })
})

describe('values of another version', () => {
  it('are the same bits at equal places, where one pose lies in between, and unknown elsewhere', () => {
    const before = refined([[0.5, [0.5, 0.5, 0]]])
    const now = refined([[1.5, [0, 0.5, 0.5]]])
    const pose = new Matrix4().makeTranslation(5, 0, -3)
    const [, { points }] = now
    for (let vertex = 4; vertex < 7; vertex++) {
      points[3 * vertex] -= 5
      points[3 * vertex + 2] += 3
    }
    const halves = Uint16Array.from({ length: 4 * 7 }, (_, i) => half(i))
    const carrier = new VersionCarrier(before, now, new Map([[1, pose]]))
    const { halves: carried } = carrier.carry({ halves, scale: 4 })
    const known = [0, 1, 2, 4, 5, 6]
    for (const vertex of known) {
      const own = [4 * vertex, 4 * vertex + 4] as const
      expect(carried.slice(...own)).toEqual(halves.slice(...own))
    }
    expect([0, 1, 2, 3, 4, 5, 6].filter((vertex) => !isUnknown(carried, vertex))).toEqual(known)
  })

  it('keep several vertices of one place apart, and know none where their number differs', () => {
    const twice = (...xs: number[]) => refined(xs.map((x) => [x, [1, 0, 0]]))
    const halves = Uint16Array.from({ length: 4 * 8 }, (_, i) => half(i))
    const carried = (before: number[], now: number[]) =>
      new VersionCarrier(twice(...before), twice(...now), new Map()).carry({ halves, scale: 1 }).halves
    const known = carried([0.5, 0.5], [0.7, 0.5, 0.5])
    expect([3, 4, 5].map((vertex) => isUnknown(known, vertex))).toEqual([true, false, false])
    expect(known.slice(16, 24)).toEqual(halves.slice(12, 20))
    expect(isUnknown(carried([0.5, 0.5], [0.5]), 3)).toBe(true)
  })
})

function frame(seq: number): ValuesFrame {
  return {
    seq,
    revision: 1,
    scale: 1,
    full: true,
    preview: false,
    rest: true,
    runs: [],
    halves: new Uint16Array(),
  }
}

const done: string[] = []
let answers: ((loaded: Loaded) => void)[] = []
const loaded = { info: { geometry: 1 }, buffer: new ArrayBuffer(0) } as unknown as Loaded
const settled = () => new Promise((resolve) => setTimeout(resolve))

function make(load = () => new Promise<Loaded>((resolve) => answers.push(resolve))) {
  done.length = 0
  answers = []
  return new Remeshing(
    load,
    () => done.push('swap'),
    ({ seq }, remeshed) => done.push(`apply ${seq}${remeshed ? ' first' : ''}`),
    ({ seq }) => done.push(`drop ${seq}`),
  )
}

describe('a mesh that is refined anew', () => {
  it('is drawn when it is here with its values, which wait for it', async () => {
    const remeshing = make()
    remeshing.take(frame(1))
    remeshing.announce(1, 0)
    remeshing.take(frame(2))
    remeshing.take(frame(3))
    expect(done).toEqual(['apply 1'])
    answers[0](loaded)
    await settled()
    remeshing.take(frame(4))
    expect(done).toEqual(['apply 1', 'swap', 'apply 2 first', 'apply 3', 'apply 4'])
  })

  it('waits for its values, too', async () => {
    const remeshing = make()
    remeshing.announce(1, 0)
    answers[0](loaded)
    await settled()
    expect(done).toEqual([])
    remeshing.take(frame(1))
    expect(done).toEqual(['swap', 'apply 1 first'])
  })

  it('gives way to a newer one, whose values follow', async () => {
    const remeshing = make()
    remeshing.announce(1, 0)
    remeshing.take(frame(1))
    remeshing.announce(2, 0)
    answers[0](loaded)
    await settled()
    remeshing.take(frame(2))
    expect(done).toEqual(['drop 1']) // not with the older mesh
    answers[1](loaded)
    await settled()
    expect(done).toEqual(['drop 1', 'swap', 'apply 2 first'])
  })

  it('is not loaded again where it is drawn already', () => {
    const remeshing = make()
    remeshing.announce(3, 3)
    remeshing.take(frame(1))
    expect(done).toEqual(['apply 1'])
  })

  it('that is gone leaves its values waiting for the one after it', async () => {
    const remeshing = make(() => Promise.reject(new Gone()))
    remeshing.announce(1, 0)
    remeshing.take(frame(1))
    await settled()
    expect(done).toEqual([])
    remeshing.startOver()
    remeshing.take(frame(2))
    expect(done).toEqual(['apply 2'])
  })
})
