// SPDX-License-Identifier: Apache-2.0
// What lies under a point of the picture. Rays on the CPU: they give the triangle and the weights in it,
// which a pin needs to follow the light, and spare a read-back that stalls the GPU.
import { Raycaster, Vector2, Vector3, type Camera, type Intersection, type Mesh } from 'three'
import type { Body } from './litScene'

const BESIDE = 1e-4 // of the distance from the world's origin, or metres: from where a hit is looked for again
const SAME_PLACE = 1e-4 // of the distance: two triangles of one sheet

export interface Hit {
  body: Body
  point: Vector3 // world
  local: Vector3
  vertices: [number, number, number] // of all the scene's
  weights: [number, number, number]
  sampled: boolean // seen from the side that has values
  distance: number
}

const raycaster = new Raycaster()

/** Picture position, in pixels from the top left, to -1 … 1. */
export function toDevice(canvas: HTMLCanvasElement, x: number, y: number): Vector2 {
  return new Vector2((2 * x) / canvas.clientWidth - 1, 1 - (2 * y) / canvas.clientHeight)
}

export function pick(camera: Camera, bodies: Body[], at: Vector2): Hit | null {
  raycaster.setFromCamera(at, camera)
  const hits = raycaster.intersectObjects(
    bodies.filter((body) => body.visible),
    false,
  )
  if (hits.length === 0) return null
  // Of the triangles of a sheet that is lit on both sides, the one that faces the eye counts.
  const near = hits.filter((hit) => hit.distance < hits[0].distance * (1 + SAME_PLACE))
  return hitOf(near.find(faces) ?? hits[0])
}

function hitOf(hit: Intersection): Hit {
  const body = hit.object as unknown as Body
  const { a, b, c } = hit.face!
  const first = body.userData.info.first_vertex
  const { x, y, z } = hit.barycoord!
  return {
    body,
    point: hit.point,
    local: body.worldToLocal(hit.point.clone()),
    vertices: [first + a, first + b, first + c],
    weights: [x, y, z],
    sampled: faces(hit),
    distance: hit.distance,
  }
}

/** Where something was hit, and its triangle's normal there, in the world. */
export interface Place {
  point: Vector3
  normal: Vector3
}

export function placeOf({ body, local, vertices }: Hit): Place {
  const points = body.geometry.getAttribute('position')
  const [a, b, c] = vertices.map((vertex) =>
    new Vector3().fromBufferAttribute(points, vertex - body.userData.info.first_vertex),
  )
  const normal = b.sub(a).cross(c.sub(a)).normalize()
  return {
    point: body.localToWorld(local.clone()),
    normal: normal.transformDirection(body.matrixWorld),
  }
}

/** What was hit there, in the triangles that its body has now; null where they are no longer there. */
export function hitAgain({ body, sampled }: Hit, { point, normal }: Place): Hit | null {
  const reach = BESIDE * (1 + point.length())
  raycaster.set(point.clone().addScaledVector(normal, reach), normal.clone().negate())
  const found = raycaster.intersectObject(body, false)[0]
  if (!found || found.distance > 2 * reach) return null
  return { ...hitOf(found), sampled }
}

/** How far a way from a point leads before it meets a body. */
export function clearDistance(bodies: Body[], from: Vector3, way: Vector3): number {
  raycaster.set(from, way)
  const seen = bodies.filter((body) => body.visible)
  return raycaster.intersectObjects(seen, false)[0]?.distance ?? Infinity
}

function faces(hit: Intersection): boolean {
  const normal = hit.face!.normal.clone().transformDirection((hit.object as Mesh).matrixWorld)
  return normal.dot(raycaster.ray.direction) < 0
}
