// SPDX-License-Identifier: Apache-2.0
// Values of one refinement of the scene's mesh taken over to another, to compare light before and after.
import { DataUtils } from 'three'
import type { Refinement } from './geometry'
import { CHANNELS, isUnknown, UNKNOWN, type Snapshot } from './values'

export const NONE = -1 // instead of a vertex before

/** The bits of the vertices `from`, of each vertex now; 0 where there was none. */
export function taken(halves: Uint16Array, from: Int32Array): Uint16Array {
  const carried = new Uint16Array(CHANNELS * from.length)
  from.forEach((before, vertex) => {
    if (before === NONE) return
    for (let c = 0; c < CHANNELS; c++) carried[CHANNELS * vertex + c] = halves[CHANNELS * before + c]
  })
  return carried
}

export class Carrier {
  private readonly from: Int32Array // vertex before, of each vertex now
  private readonly between: number[] = [] // places in `detail` of vertices that were not there

  constructor(
    before: Refinement,
    private readonly now: Refinement,
  ) {
    this.from = new Int32Array(now[0].vertices).fill(NONE)
    const [plainBefore, plainNow] = [plainVertices(before), plainVertices(now)]
    plainNow.forEach((vertex, i) => (this.from[vertex] = plainBefore[i]))
    const places = new Map<string, number>()
    forEachDetail(before, (vertex, place) => places.set(place, vertex))
    forEachDetail(now, (vertex, place, i) => {
      const same = places.get(place)
      if (same === undefined) this.between.push(i)
      else this.from[vertex] = same
    })
  }

  /** The same bits at vertices that were there, interpolated values at others. */
  carry({ halves, scale }: Snapshot): Snapshot {
    const carried = taken(halves, this.from)
    const { detail, detailCorners, detailWeights } = this.now[1]
    for (const i of this.between) {
      const corners = detailCorners.subarray(3 * i, 3 * i + 3)
      if (corners.some((corner) => isUnknown(carried, corner))) {
        carried.set(UNKNOWN, CHANNELS * detail[i])
        continue
      }
      for (let c = 0; c < CHANNELS; c++) {
        let sum = 0
        for (let k = 3 * i; k < 3 * i + 3; k++) {
          sum += detailWeights[k] * DataUtils.fromHalfFloat(carried[CHANNELS * detailCorners[k] + c])
        }
        carried[CHANNELS * detail[i] + c] = DataUtils.toHalfFloat(sum)
      }
    }
    return { halves: repeated(carried, this.now), scale }
  }
}

/** Gives copies the bits of what they repeat, in place. */
export function repeated(halves: Uint16Array, [, { copies }]: Refinement): Uint16Array {
  for (const copy of copies) {
    halves.copyWithin(CHANNELS * copy, CHANNELS * (copy - 1), CHANNELS * copy)
  }
  return halves
}

/** Those that no refinement added, without copies; their order is always the same. */
function plainVertices([{ vertices }, { detail, copies }]: Refinement): Uint32Array {
  const plain = new Uint8Array(vertices).fill(1)
  for (const other of [detail, copies]) for (const vertex of other) plain[vertex] = 0
  return Uint32Array.from({ length: vertices }, (_, vertex) => vertex).filter((vertex) => plain[vertex])
}

/** Calls `visit` with each vertex that refines shadows and a text that is equal for equal places. */
function forEachDetail(
  [{ meshes }, { detail, points, normals }]: Refinement,
  visit: (vertex: number, place: string, index: number) => void,
): void {
  let mesh = 0
  detail.forEach((vertex, i) => {
    while (vertex >= meshes[mesh].first_vertex + meshes[mesh].vertex_count) mesh++
    const at = 3 * vertex
    visit(vertex, `${mesh} ${points.subarray(at, at + 3).join()} ${normals.subarray(at, at + 3).join()}`, i)
  })
}
