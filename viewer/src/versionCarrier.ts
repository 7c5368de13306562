// SPDX-License-Identifier: Apache-2.0
// Values taken over to another version of the scene, in which other things can be moved: by equal places.
import { Matrix4, Vector3 } from 'three'
import { NONE, repeated, taken } from './carrier'
import type { Refinement } from './geometry'
import { CHANNELS, UNKNOWN, type Snapshot } from './values'

const STEP = 1e-4 // of the scene's size: places that are nearer to each other count as equal
const TURN = 0.02 // likewise of normals

export class VersionCarrier {
  private readonly from: Int32Array // vertex before, of each vertex now

  /** `poses`: of meshes, by their index, that could not be moved before: vertices now are local to them. */
  constructor(
    before: Refinement,
    private readonly now: Refinement,
    poses: ReadonlyMap<number, Matrix4>,
  ) {
    this.from = new Int32Array(now[0].vertices).fill(NONE)
    const [low, high] = now[0].bounds.map((corner) => new Vector3(...corner))
    const step = STEP * low.distanceTo(high) || STEP
    now[0].meshes.forEach((_, mesh) => {
      const pose = poses.get(mesh) ?? new Matrix4()
      if (!pose.equals(new Matrix4()) || !this.keep(before, now, mesh)) {
        this.match(placesOf(before, mesh, step, new Matrix4()), placesOf(now, mesh, step, pose))
      }
    })
  }

  /** The same bits at places that were there; others have no value to compare with. */
  carry({ halves, scale }: Snapshot): Snapshot {
    const carried = taken(halves, this.from)
    this.from.forEach((before, vertex) => {
      if (before === NONE) carried.set(UNKNOWN, CHANNELS * vertex)
    })
    return { halves: repeated(carried, this.now), scale }
  }

  /** Takes a mesh whose vertices are all the same, in the same order; tells whether it is one. */
  private keep([infoBefore, before]: Refinement, [infoNow, now]: Refinement, mesh: number): boolean {
    const [was, is] = [infoBefore.meshes[mesh], infoNow.meshes[mesh]]
    if (was.vertex_count !== is.vertex_count) return false
    const [from, to] = [3 * was.first_vertex, 3 * is.first_vertex]
    for (let i = 0; i < 3 * is.vertex_count; i++) {
      if (before.points[from + i] !== now.points[to + i]) return false
      if (before.normals[from + i] !== now.normals[to + i]) return false
    }
    for (let i = 0; i < is.vertex_count; i++) this.from[is.first_vertex + i] = was.first_vertex + i
    return true
  }

  /** Several vertices in one place, as on the two sides of a partition's foot, keep their order. */
  private match(before: Map<string, number[]>, now: Map<string, number[]>): void {
    for (const [place, vertices] of now) {
      const found = before.get(place)
      if (found?.length === vertices.length) vertices.forEach((vertex, i) => (this.from[vertex] = found[i]))
    }
  }
}

/** Vertices of a mesh by place and normal. */
function placesOf(
  [{ meshes }, { points, normals, copies }]: Refinement,
  mesh: number,
  step: number,
  pose: Matrix4,
): Map<string, number[]> {
  const places = new Map<string, number[]>()
  const { first_vertex: first, vertex_count: count } = meshes[mesh]
  const repeats = new Set(copies)
  const [point, normal] = [new Vector3(), new Vector3()]
  for (let vertex = first; vertex < first + count; vertex++) {
    if (repeats.has(vertex)) continue
    point
      .fromArray(points, 3 * vertex)
      .applyMatrix4(pose)
      .divideScalar(step)
      .round()
    normal
      .fromArray(normals, 3 * vertex)
      .transformDirection(pose)
      .divideScalar(TURN)
      .round()
    const place = `${point.toArray().join()} ${normal.toArray().join()}`
    const there = places.get(place)
    if (there) there.push(vertex)
    else places.set(place, [vertex])
  }
  return places
}
