// SPDX-License-Identifier: Apache-2.0
// The viewer's protocol (docs/reference/viewer-protocol.md): messages, what scene.json holds, decoding of frames.

export type Pose = number[] // 16 numbers, column-major, rigid, local to world
export type Rgb = [number, number, number]
export type Unit = 'lux' | 'W/m2'

export interface ArrayPlace {
  offset: number
  length: number
  type: 'f32' | 'u32'
}

export interface PartInfo {
  mesh: number
  material: number
  first: number
  count: number
  reversed: boolean
}

export interface MeshInfo {
  name: string
  movable: boolean
  closed: boolean // no back can be seen
  first_vertex: number
  vertex_count: number
}

/** An image on surfaces, as in glTF; its factor on a material's mean colour is texel / mean. */
export interface TextureInfo {
  image: number
  mean: Rgb
  wrap: [number, number] // along u and v: repeat, clamp or mirror, as OpenGL numbers them
  mag_filter: number | null // likewise
  min_filter: number | null
  matrix: number[] // two rows of three: takes (u, v, 1) to the place in the image
}

export interface MaterialInfo {
  name: string
  reflectance: Rgb
  emission: Rgb // undimmed
  group: string | null // whose factor dims the emission
  two_sided: boolean
  colour: TextureInfo | null // of the reflectance
  glow: TextureInfo | null // of the emission
  opacity: number // share of what is behind that it hides
  scattered: number // factor on its own reflectance as it is shown: glass shows none
  by_alpha: boolean // whether the alpha of its colour is a factor on that
  cut_out: number | null // least alpha of the colour that is shown; null: all is
}

export interface CameraInfo {
  name: string
  pose: Pose
  vertical_fov: number
}

export interface SceneInfo {
  protocol: number
  name: string
  unit: Unit
  run: string
  geometry: number // one more each time that the mesh was refined anew
  version: number // one more each time that another version of the scene was baked
  bounds: [Rgb, Rgb]
  vertices: number
  triangles: number
  arrays: Record<
    | 'points'
    | 'normals'
    | 'indices'
    | 'coordinates'
    | 'copies'
    | 'detail'
    | 'detail_corners'
    | 'detail_weights',
    ArrayPlace
  >
  parts: PartInfo[]
  meshes: MeshInfo[]
  materials: MaterialInfo[]
  groups: string[]
  cameras: CameraInfo[]
  folder: boolean
  lit: boolean // there is light, which follows when the page is connected
}

export type * from './messages'

export interface Run {
  first: number // vertex
  count: number
}

export interface ValuesFrame {
  seq: number
  revision: number
  scale: number // the halves are values × scale
  full: boolean
  preview: boolean
  rest: boolean // the light of its revision is complete, and nothing is being dragged
  runs: Run[]
  halves: Uint16Array // 4 for each vertex, the runs one after the other
}

const MAGIC = 0x58544c44
const HEADER_BYTES = 24
const FLAG_FULL = 1
const FLAG_PREVIEW = 2
const FLAG_REST = 4

/** Values of a binary frame; throws where it is not one, or not whole. */
export function decodeFrame(buffer: ArrayBuffer): ValuesFrame {
  const view = new DataView(buffer)
  if (buffer.byteLength < HEADER_BYTES || view.getUint32(0, true) !== MAGIC) {
    throw new Error(`frame: found ${buffer.byteLength} bytes without the mark of one`)
  }
  const flags = view.getUint32(16, true)
  const runCount = view.getUint32(20, true)
  const runs: Run[] = []
  let vertices = 0
  for (let i = 0; i < runCount; i++) {
    const first = view.getUint32(HEADER_BYTES + 8 * i, true)
    const count = view.getUint32(HEADER_BYTES + 8 * i + 4, true)
    runs.push({ first, count })
    vertices += count
  }
  const start = HEADER_BYTES + 8 * runCount
  if (buffer.byteLength !== start + 8 * vertices) {
    throw new Error(`frame: found ${buffer.byteLength} bytes, expected ${start + 8 * vertices}`)
  }
  return {
    seq: view.getUint32(4, true),
    revision: view.getUint32(8, true),
    scale: view.getFloat32(12, true),
    full: (flags & FLAG_FULL) !== 0,
    preview: (flags & FLAG_PREVIEW) !== 0,
    rest: (flags & FLAG_REST) !== 0,
    runs,
    halves: new Uint16Array(buffer, start, 4 * vertices),
  }
}
