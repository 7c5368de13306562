// SPDX-License-Identifier: Apache-2.0
// Moving the selected object: arrows and rings at its pivot, or dragging the object itself along the floor.
import {
  Box3,
  BufferGeometry,
  Euler,
  MathUtils,
  Matrix4,
  Mesh,
  Object3D,
  Plane,
  Quaternion,
  Raycaster,
  Vector2,
  Vector3,
} from 'three'
import { TransformControls } from 'three/addons/controls/TransformControls.js'
import type { Body } from './litScene'
import type { Stage } from './stage'

export type GizmoMode = 'translate' | 'rotate'

export const TRANSLATION_STEP = 0.1 // metres
export const ROTATION_STEP = 15 // degrees

/** Position of the pivot in the world and turns about X, Y, Z in degrees: what the number fields show. */
export interface Placement {
  position: [number, number, number]
  degrees: [number, number, number]
}

export interface GizmoListener {
  /** The object is at a new pose; `dragging`: and will have others. */
  moved(body: Body, pose: Matrix4, dragging: boolean): void
}

export class Gizmo {
  readonly controls: TransformControls
  body: Body | null = null
  dragging = false
  private readonly handle = new Object3D() // at the pivot; the object follows it
  private pivot = new Vector3() // in the object's own space
  private floorDrag: { plane: Plane; offset: Vector3; moved: boolean } | null = null
  private snapping = false

  constructor(
    private readonly stage: Stage,
    private readonly listener: GizmoListener,
  ) {
    this.controls = new TransformControls(stage.camera, stage.canvas)
    this.controls.setSize(0.9)
    // The object itself is the handle for its plane; boxes and circles over it would only be in the way.
    for (const extra of ['showXY', 'showXZ', 'showYZ', 'showXYZE', 'showE'] as const)
      this.controls[extra] = false
    removeFarHeads(this.controls.getHelper())
    stage.scene.add(this.handle, this.controls.getHelper())
    this.controls.addEventListener('change', stage.invalidate)
    this.controls.addEventListener('objectChange', () => this.follow(true))
    this.controls.addEventListener('dragging-changed', (event) => {
      this.dragging = event.value === true
      if (!this.dragging) this.follow(false)
    })
  }

  /** Whether the pointer is on an arrow or ring, or drags one. */
  get engaged(): boolean {
    return this.controls.axis !== null || this.dragging
  }

  /** Whether a press goes to the body under it: where no handle is, and over its own upright arrow. */
  leavesTo(body: Body | undefined): boolean {
    return !this.engaged || (body !== undefined && body === this.body && this.controls.axis === 'Y')
  }

  /** Takes part in what the pointer does, or not. */
  setListening(on: boolean): void {
    this.controls.enabled = on
  }

  attach(body: Body | null): void {
    this.body = body
    if (!body) {
      this.controls.detach()
      this.stage.invalidate()
      return
    }
    this.pivot = pivotOf(body)
    this.controls.attach(this.handle)
    this.refresh()
  }

  /** Takes over the object's pose, which the server or the user's numbers changed. */
  refresh(): void {
    if (!this.body || this.dragging) return
    const pose = this.body.matrix.clone().multiply(new Matrix4().setPosition(this.pivot))
    pose.decompose(this.handle.position, this.handle.quaternion, new Vector3())
    this.handle.updateMatrixWorld(true)
    this.controls.getHelper().visible = this.body.visible
    this.stage.invalidate()
  }

  setMode(mode: GizmoMode): void {
    this.controls.setMode(mode)
    this.stage.invalidate()
  }

  setSnapping(on: boolean): void {
    this.snapping = on
    this.controls.setTranslationSnap(on ? TRANSLATION_STEP : null)
    this.controls.setRotationSnap(on ? MathUtils.degToRad(ROTATION_STEP) : null)
  }

  placement(): Placement {
    const angles = new Euler().setFromQuaternion(this.handle.quaternion, 'YXZ')
    return {
      position: this.handle.position.toArray(),
      degrees: [angles.x, angles.y, angles.z].map(MathUtils.radToDeg) as Placement['degrees'],
    }
  }

  /** Puts the object where numbers say. */
  place({ position, degrees }: Placement): void {
    const [x, y, z] = degrees.map(MathUtils.degToRad)
    this.handle.position.fromArray(position)
    this.handle.quaternion.setFromEuler(new Euler(x, y, z, 'YXZ'))
    this.follow(false)
  }

  /** Moves the object by metres along world axes, as arrow keys do. */
  nudge(way: Vector3): void {
    this.handle.position.add(way)
    this.follow(false)
  }

  /** Begins to drag the object itself along the horizontal plane through `point`. */
  startFloorDrag(point: Vector3): void {
    const plane = new Plane().setFromNormalAndCoplanarPoint(new Vector3(0, 1, 0), point)
    this.floorDrag = { plane, offset: this.handle.position.clone().sub(point), moved: false }
    this.dragging = true
  }

  floorDragTo(at: Vector2): void {
    if (!this.floorDrag) return
    const raycaster = new Raycaster()
    raycaster.setFromCamera(at, this.stage.camera)
    const point = raycaster.ray.intersectPlane(this.floorDrag.plane, new Vector3())
    if (!point) return // beyond the horizon
    point.add(this.floorDrag.offset)
    if (this.snapping) {
      point.x = Math.round(point.x / TRANSLATION_STEP) * TRANSLATION_STEP
      point.z = Math.round(point.z / TRANSLATION_STEP) * TRANSLATION_STEP
    }
    this.handle.position.setX(point.x).setZ(point.z) // its height stays, to the last bit
    this.floorDrag.moved = true
    this.follow(true)
  }

  endFloorDrag(): void {
    if (!this.floorDrag) return
    const { moved } = this.floorDrag
    this.floorDrag = null
    this.dragging = false
    if (moved) this.follow(false)
  }

  get floorDragging(): boolean {
    return this.floorDrag !== null
  }

  /** World position of the middle of an arrow. */
  arrow(axis: 'X' | 'Y' | 'Z'): Vector3 {
    const { camera } = this.stage
    const distance = this.handle.position.distanceTo(camera.position)
    const factor = Math.min((1.9 * Math.tan(MathUtils.degToRad(camera.fov) / 2)) / camera.zoom, 7)
    const length = (0.55 * distance * factor * this.controls.size) / 4
    const way = new Vector3(Number(axis === 'X'), Number(axis === 'Y'), Number(axis === 'Z'))
    return this.handle.position.clone().addScaledVector(way, length)
  }

  private follow(dragging: boolean): void {
    if (!this.body) return
    this.handle.updateMatrix()
    const { position, quaternion } = this.handle
    const shift = new Matrix4().makeTranslation(this.pivot.clone().negate())
    const pose = new Matrix4().compose(
      position,
      new Quaternion().copy(quaternion).normalize(),
      new Vector3(1, 1, 1),
    )
    pose.multiply(shift)
    this.body.matrix.copy(pose)
    this.body.matrixWorldNeedsUpdate = true
    this.listener.moved(this.body, pose, dragging)
    this.stage.invalidate()
  }
}

/** The object's own origin where it lies in its bounds; else the middle of its underside. */
function pivotOf(body: Body): Vector3 {
  body.geometry.computeBoundingBox()
  const box = body.geometry.boundingBox ?? new Box3()
  const reach = 0.01 * box.getSize(new Vector3()).length()
  if (box.clone().expandByScalar(reach).containsPoint(new Vector3())) return new Vector3()
  const centre = box.getCenter(new Vector3())
  return centre.setY(box.min.y)
}

/** Takes away the heads at the far ends of the axes: they have no shaft, and look like something that was left over. */
function removeFarHeads(helper: Object3D): void {
  const heads: Object3D[] = []
  helper.traverse((part) => {
    if (!(part instanceof Mesh) || !['X', 'Y', 'Z'].includes(part.name)) return
    const geometry = part.geometry as BufferGeometry
    geometry.computeBoundingSphere()
    const { center, radius } = geometry.boundingSphere!
    if (Math.min(center.x, center.y, center.z) < -2 * radius) heads.push(part)
  })
  for (const head of heads) head.removeFromParent()
}
