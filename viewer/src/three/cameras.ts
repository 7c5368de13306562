// SPDX-License-Identifier: Apache-2.0
// Where the scene is seen from: orbit, fly, the scene's own cameras, fit to an object or to everything.
import { Box3, Euler, MathUtils, Matrix4, Spherical, Vector3 } from 'three'
import { OrbitControls } from 'three/addons/controls/OrbitControls.js'
import type { CameraInfo } from '../protocol'
import type { Stage } from './stage'

const FLY_KEYS: Record<string, [number, number, number]> = {
  KeyW: [0, 0, -1],
  KeyS: [0, 0, 1],
  KeyA: [-1, 0, 0],
  KeyD: [1, 0, 0],
  KeyQ: [0, -1, 0],
  KeyE: [0, 1, 0],
}
const FLY_SPEED = 0.12 // of the scene's diagonal a second
const CLEARANCE = 0.9 // of the way to what would be in front of the eye
const TURNS = [0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180] // degrees around the vertical
const HEIGHTS = [75, 50, 25] // degrees from the vertical, after the present one
const TURN_SPEED = 0.003 // radians a pixel

export class Cameras {
  readonly orbit: OrbitControls
  flying = false
  private readonly keys = new Set<string>()
  private looking: number | null = null // pointer that turns the head

  constructor(
    private readonly stage: Stage,
    bounds: Box3,
  ) {
    const diagonal = bounds.getSize(new Vector3()).length() || 1
    stage.camera.near = diagonal / 500 // any nearer, and pictures on far walls flicker through each other
    stage.camera.far = diagonal * 5
    this.orbit = new OrbitControls(stage.camera, stage.canvas)
    this.orbit.addEventListener('change', stage.invalidate)
    stage.beforeDrawing.push((seconds) => this.step(seconds, diagonal))
    stage.canvas.addEventListener('pointerdown', this.startLooking)
    stage.canvas.addEventListener('pointermove', this.look)
    for (const end of ['pointerup', 'pointercancel'] as const) {
      stage.canvas.addEventListener(end, () => (this.looking = null))
    }
    window.addEventListener('blur', () => this.keys.clear())
  }

  /** Shows what one of the scene's cameras sees; `distance`: how far away the orbit's centre is. */
  show(camera: CameraInfo, distance: number): void {
    const pose = new Matrix4().fromArray(camera.pose)
    const ahead = new Vector3().setFromMatrixColumn(pose, 2).negate()
    const eye = new Vector3().setFromMatrixPosition(pose)
    this.stage.fieldOfView = MathUtils.radToDeg(camera.vertical_fov)
    this.lookFrom(eye, eye.clone().addScaledVector(ahead, distance))
  }

  /**
   * Looks at the box from where it is seen: `clear` tells how far a way from its middle leads before it meets
   * something. The direction is kept where that does, else turned as little as it takes; where there is no
   * room for the whole box anywhere, the eye goes as far away as it can without leaving through a wall.
   */
  fit(box: Box3, clear: (from: Vector3, way: Vector3) => number): void {
    const centre = box.getCenter(new Vector3())
    const radius = Math.max(box.getSize(new Vector3()).length() / 2, 1e-3)
    const vertical = MathUtils.degToRad(this.stage.camera.fov) / 2
    const angle = Math.min(vertical, Math.atan(Math.tan(vertical) * this.stage.aspect))
    const away = this.stage.camera.position.clone().sub(this.orbit.target).normalize()
    if (away.lengthSq() === 0) away.set(0.5, 0.4, 1).normalize()
    const wanted = (1.1 * radius) / Math.sin(angle)
    let [best, room] = [away, 0]
    for (const way of waysAround(away)) {
      const free = CLEARANCE * clear(centre, way)
      if (free > room) [best, room] = [way, free]
      if (free >= wanted) break
    }
    this.lookFrom(centre.clone().addScaledVector(best, Math.min(wanted, room || wanted)), centre)
  }

  lookFrom(eye: Vector3, target: Vector3): void {
    this.stage.camera.position.copy(eye)
    this.stage.camera.updateProjectionMatrix() // near and far are new at first
    this.orbit.target.copy(target)
    this.orbit.update()
    this.stage.invalidate()
  }

  fly(on: boolean): void {
    this.flying = on
    this.orbit.enabled = !on
    this.keys.clear()
    if (!on) this.orbit.update()
  }

  /** Takes a key that flying uses; tells whether it did. */
  key(code: string, down: boolean): boolean {
    if (!this.flying || !(code in FLY_KEYS)) return false
    if (down) this.keys.add(code)
    else this.keys.delete(code)
    this.stage.invalidate()
    return true
  }

  private step(seconds: number, diagonal: number): boolean {
    if (!this.flying || this.keys.size === 0) return false
    const way = new Vector3()
    for (const code of this.keys) way.add(new Vector3(...FLY_KEYS[code]))
    way.multiplyScalar(FLY_SPEED * diagonal * seconds).applyQuaternion(this.stage.camera.quaternion)
    this.stage.camera.position.add(way)
    this.orbit.target.add(way)
    return true
  }

  private startLooking = (event: PointerEvent): void => {
    if (this.flying) this.looking = event.pointerId
  }

  private look = (event: PointerEvent): void => {
    if (this.looking !== event.pointerId) return
    const { camera } = this.stage
    const angles = new Euler().setFromQuaternion(camera.quaternion, 'YXZ')
    const limit = Math.PI / 2 - 0.01
    angles.set(
      MathUtils.clamp(angles.x - TURN_SPEED * event.movementY, -limit, limit),
      angles.y - TURN_SPEED * event.movementX,
      0,
    )
    camera.quaternion.setFromEuler(angles)
    const distance = camera.position.distanceTo(this.orbit.target)
    this.orbit.target
      .copy(camera.position)
      .add(camera.getWorldDirection(new Vector3()).multiplyScalar(distance))
    this.stage.invalidate()
  }
}

/** Directions all around and above, those first that are close to a given one. */
function* waysAround(way: Vector3): Iterable<Vector3> {
  const { phi, theta } = new Spherical().setFromVector3(way)
  for (const height of [phi, ...HEIGHTS.map(MathUtils.degToRad)]) {
    for (const turn of TURNS) {
      yield new Vector3().setFromSphericalCoords(1, height, theta + MathUtils.degToRad(turn))
    }
  }
}
