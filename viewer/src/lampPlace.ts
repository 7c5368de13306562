// SPDX-License-Identifier: Apache-2.0
// Where an added lamp hangs: below the ceiling, between the eye and what it looks at.
import { Box3, Vector3 } from 'three'

const ALONG = 0.6 // of the way from the eye to what it sees
const DROP = 0.2 // of the room's height, from the ceiling,
const LONGEST_DROP = 0.5 // and at most so many metres
const MARGIN = 0.02 // of the scene's size, from its bounds

/**
 * `seen`: what is in the middle of the picture, null where that is nothing; `clear` tells how far a way leads
 * before it meets something.
 */
export function lampPlace(
  eye: Vector3,
  seen: Vector3 | null,
  bounds: Box3,
  clear: (from: Vector3, way: Vector3) => number,
): Vector3 {
  const inner = bounds.clone().expandByVector(bounds.getSize(new Vector3()).multiplyScalar(-MARGIN))
  const place = seen ? eye.clone().lerp(seen, ALONG) : bounds.getCenter(new Vector3())
  place.clamp(inner.min, inner.max)
  const ceiling = Math.min(place.y + clear(place, new Vector3(0, 1, 0)), bounds.max.y)
  const floor = Math.max(place.y - clear(place, new Vector3(0, -1, 0)), bounds.min.y)
  return place.setY(ceiling - Math.min(DROP * (ceiling - floor), LONGEST_DROP))
}
