// SPDX-License-Identifier: Apache-2.0
// The scene as drawn: one mesh with groups for each mesh of the server's, values as an attribute of halves.
import { Box3, BufferAttribute, BufferGeometry, DynamicDrawUsage, Group, Matrix4, Mesh, Vector3 } from 'three'
import { Carrier } from '../carrier'
import type { GeometryArrays, Refinement } from '../geometry'
import type { MeshInfo, PartInfo, Pose, Run, SceneInfo, ValuesFrame } from '../protocol'
import { CHANNELS, Values, type Snapshot } from '../values'
import { Signal } from '../signal'
import { VersionCarrier } from '../versionCarrier'
import { SurfaceMaterials } from './materials'
import { Factors } from './textures'

const MOST_OF_16_BITS = 65535 // vertices of a mesh; the last number of 16 bits means the end of a strip
const MAX_RANGES = 16 // of one mesh waiting for upload; more become one that covers them

/** One drawn mesh and its place among all vertices. */
export interface Body extends Mesh<BufferGeometry, SurfaceMaterials['all']> {
  userData: { info: MeshInfo }
}

export class LitScene {
  readonly root = new Group()
  readonly materials: SurfaceMaterials
  readonly factors: Factors
  readonly values: Values
  readonly bodies: Body[] = []
  readonly version = new Signal(0) // of the scene: other things can be moved, there are other lights
  private readonly byName = new Map<string, Body>()
  private compared: { with: Snapshot; halves: Uint16Array } | null = null // what the graphics card has

  /**
   * `oneTriangle`: draw next to nothing, but upload all (to measure transport without rasterisation);
   * `warmUp`: is told of the materials as soon as they are there, before the geometry is made.
   */
  constructor(
    public info: SceneInfo,
    private arrays: GeometryArrays,
    private readonly oneTriangle = false,
    warmUp: (materials: SurfaceMaterials) => void = () => {},
  ) {
    this.factors = new Factors(info.materials, arrays.coordinates.length > 0)
    this.materials = new SurfaceMaterials(info.materials, this.factors)
    warmUp(this.materials)
    this.values = new Values(info.vertices)
    const geometries = this.geometries()
    info.meshes.forEach((mesh, i) => {
      const body = new Mesh(geometries[i], this.materials.all) as unknown as Body
      body.name = mesh.name
      body.userData.info = mesh
      body.frustumCulled = !oneTriangle
      body.matrixAutoUpdate = false
      this.bodies.push(body)
      this.byName.set(mesh.name, body)
      this.root.add(body)
    })
  }

  get movables(): Body[] {
    return this.bodies.filter((body) => body.userData.info.movable)
  }

  body(name: string): Body | undefined {
    return this.byName.get(name)
  }

  /** Corners of a body's triangles, one vertex for all that only differ in texture coordinates. */
  corners({ geometry, userData }: Body): ArrayLike<number> {
    const corners = geometry.index!.array
    const { copies } = this.arrays
    if (copies.length === 0) return corners
    const { first_vertex: first, vertex_count: count } = userData.info
    const originals = Uint32Array.from({ length: count }, (_, vertex) => vertex)
    for (const copy of copies) {
      if (copy > first && copy < first + count) originals[copy - first] = originals[copy - first - 1]
    }
    return Uint32Array.from(corners, (vertex) => originals[vertex])
  }

  /** Bounds as loaded. */
  get bounds(): Box3 {
    const [low, high] = this.info.bounds
    return new Box3(new Vector3(...low), new Vector3(...high))
  }

  setPose(name: string, pose: Pose | null): void {
    const body = this.byName.get(name)
    if (!body?.userData.info.movable) return
    body.visible = pose !== null
    if (pose) body.matrix.fromArray(pose)
    body.matrixWorldNeedsUpdate = true
  }

  pose(name: string): Matrix4 {
    return this.byName.get(name)?.matrix.clone() ?? new Matrix4()
  }

  apply(frame: ValuesFrame): void {
    for (const run of this.values.apply(frame)) this.upload(run)
    this.materials.shared.valueScale.value = 1 / this.values.scale
  }

  /** Uploads the state that differences are drawn against, unless it is there. */
  uploadReference(): void {
    const { reference } = this.values
    if (!reference || this.compared?.with === reference) return
    const halves = this.compared?.halves ?? new Uint16Array(reference.halves.length)
    halves.set(reference.halves)
    for (const { geometry, userData } of this.bodies) {
      if (!this.compared) geometry.setAttribute('reference', valuesAttribute(halves, userData.info))
      geometry.getAttribute('reference').needsUpdate = true
    }
    this.materials.shared.referenceScale.value = 1 / reference.scale
    this.compared = { with: reference, halves }
  }

  /**
   * Takes another refinement, or version, of the same scene; returns how values of the one before go along.
   * `poses`: of what can be moved.
   */
  remesh(
    info: SceneInfo,
    arrays: GeometryArrays,
    poses: Record<string, Pose | null>,
  ): Carrier | VersionCarrier {
    const [before, now]: Refinement[] = [
      [this.info, this.arrays],
      [info, arrays],
    ]
    const other = info.version !== this.info.version
    const carrier = other
      ? new VersionCarrier(before, now, this.newPoses(info, poses))
      : new Carrier(before, now)
    this.info = info
    this.arrays = arrays
    this.values.resize(info.vertices)
    this.compared = null
    const geometries = this.geometries()
    this.bodies.forEach((body, i) => {
      body.geometry.dispose()
      body.geometry = geometries[i]
      body.userData.info = info.meshes[i]
    })
    if (other) this.version.value = info.version
    return carrier
  }

  /** Poses of the meshes that cannot be moved yet, and can in `info`, by their index. */
  private newPoses(info: SceneInfo, poses: Record<string, Pose | null>): Map<number, Matrix4> {
    const found = new Map<number, Matrix4>()
    info.meshes.forEach(({ name, movable }, i) => {
      const pose = poses[name]
      if (movable && pose && !this.info.meshes[i].movable) found.set(i, new Matrix4().fromArray(pose))
    })
    return found
  }

  /** One for each mesh. */
  private geometries(): BufferGeometry[] {
    const parts = this.info.meshes.map((): PartInfo[] => [])
    for (const part of this.info.parts) parts[part.mesh].push(part)
    return this.info.meshes.map((mesh, i) => {
      const geometry = this.geometry(mesh, parts[i], this.arrays)
      if (this.oneTriangle) geometry.setDrawRange(0, 3)
      return geometry
    })
  }

  private geometry(mesh: MeshInfo, parts: PartInfo[], arrays: GeometryArrays): BufferGeometry {
    const { first_vertex: first, vertex_count: count } = mesh
    const geometry = new BufferGeometry()
    const vectors = (array: Float32Array) =>
      new BufferAttribute(array.subarray(3 * first, 3 * (first + count)), 3)
    geometry.setAttribute('position', vectors(arrays.points))
    geometry.setAttribute('normal', vectors(arrays.normals))
    if (arrays.coordinates.length) {
      const own = arrays.coordinates.subarray(2 * first, 2 * (first + count))
      geometry.setAttribute('uv', new BufferAttribute(own, 2))
    }
    geometry.setAttribute('values', valuesAttribute(this.values.halves, mesh))
    const triangles = this.groupedIndices(geometry, parts, arrays.indices, mesh)
    geometry.setIndex(new BufferAttribute(triangles, 1))
    return geometry
  }

  /** Triangles of equal material next to each other, so that groups are few, whatever the parts. */
  private groupedIndices(
    geometry: BufferGeometry,
    parts: PartInfo[],
    indices: Uint32Array,
    { first_vertex: firstVertex, vertex_count: vertexCount, closed }: MeshInfo,
  ): Uint16Array | Uint32Array {
    const buckets = new Map<number, PartInfo[]>()
    for (const part of parts) {
      const index = SurfaceMaterials.index(part.material, part.reversed, closed)
      buckets.set(index, [...(buckets.get(index) ?? []), part])
    }
    const count = parts.reduce((sum, part) => sum + 3 * part.count, 0)
    const grouped = vertexCount <= MOST_OF_16_BITS ? new Uint16Array(count) : new Uint32Array(count)
    let end = 0
    for (const [material, members] of buckets) {
      const start = end
      for (const part of members) {
        const last = 3 * (part.first + part.count)
        for (let i = 3 * part.first; i < last; i++) grouped[end++] = indices[i] - firstVertex
      }
      geometry.addGroup(start, end - start, material)
    }
    return grouped
  }

  /** Asks for the upload of a run of vertices, which may reach over several meshes. */
  private upload(run: Run): void {
    for (const body of this.bodies) {
      const { first_vertex: first, vertex_count: count } = body.userData.info
      const start = Math.max(run.first, first)
      const end = Math.min(run.first + run.count, first + count)
      if (start >= end) continue
      const attribute = body.geometry.getAttribute('values') as BufferAttribute
      attribute.addUpdateRange(CHANNELS * (start - first), CHANNELS * (end - start))
      if (attribute.updateRanges.length > MAX_RANGES) coverRanges(attribute)
      attribute.needsUpdate = true
    }
  }
}

/** Attribute over the mesh's share of all halves: a view, no copy. */
function valuesAttribute(halves: Uint16Array, mesh: MeshInfo): BufferAttribute {
  const { first_vertex: first, vertex_count: count } = mesh
  const view = halves.subarray(CHANNELS * first, CHANNELS * (first + count))
  const attribute = new BufferAttribute(view, CHANNELS).setUsage(DynamicDrawUsage)
  // Marked by hand: three's own class for halves would copy the array.
  return Object.assign(attribute, { isFloat16BufferAttribute: true })
}

function coverRanges(attribute: BufferAttribute): void {
  const start = Math.min(...attribute.updateRanges.map((range) => range.start))
  const end = Math.max(...attribute.updateRanges.map((range) => range.start + range.count))
  attribute.clearUpdateRanges()
  attribute.addUpdateRange(start, end - start)
}
