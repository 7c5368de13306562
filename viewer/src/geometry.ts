// SPDX-License-Identifier: Apache-2.0
// Geometry as the server sends it: arrays of points, triangles and of what refines shadows.
import type { ArrayPlace, SceneInfo } from './protocol'

/** What `geometry.bin` holds. */
export interface GeometryArrays {
  points: Float32Array
  normals: Float32Array
  indices: Uint32Array
  coordinates: Float32Array // of textures, 2 for each vertex; empty if there is none
  copies: Uint32Array // vertices that only differ in these from the one before them
  detail: Uint32Array // vertices that refine shadows,
  detailCorners: Uint32Array // the vertices of others between which they lie, 3 for each,
  detailWeights: Float32Array // and how near they are to these
}

/** One refinement of the scene's mesh. */
export type Refinement = [Pick<SceneInfo, 'vertices' | 'meshes' | 'bounds'>, GeometryArrays]

export function geometryArrays(info: SceneInfo, buffer: ArrayBuffer): GeometryArrays {
  const floats = ({ offset, length }: ArrayPlace) => new Float32Array(buffer, offset, length / 4)
  const integers = ({ offset, length }: ArrayPlace) => new Uint32Array(buffer, offset, length / 4)
  const { arrays } = info
  return {
    points: floats(arrays.points),
    normals: floats(arrays.normals),
    indices: integers(arrays.indices),
    coordinates: floats(arrays.coordinates),
    copies: integers(arrays.copies),
    detail: integers(arrays.detail),
    detailCorners: integers(arrays.detail_corners),
    detailWeights: floats(arrays.detail_weights),
  }
}
