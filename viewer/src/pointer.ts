// SPDX-License-Identifier: Apache-2.0
// The pointer on the picture: a click selects and probes, a drag of an object moves it along the floor.
import type { Objects } from './objects'
import type { Probes } from './probes'
import type { Cameras } from './three/cameras'
import type { LitScene } from './three/litScene'
import { pick, toDevice, type Hit } from './three/picking'
import type { Stage } from './three/stage'

const CLICK_REACH = 4 // pixels that a click may wander

export class Pointer {
  private press: {
    id: number
    x: number
    y: number
    hit: Hit | null
    wandered: boolean
    shift: boolean
  } | null = null

  constructor(
    private readonly stage: Stage,
    private readonly lit: LitScene,
    private readonly objects: Objects,
    private readonly probes: Probes,
    private readonly cameras: Cameras,
  ) {
    const { canvas } = stage
    // In the capture phase, before the orbit's own listener: who drags an object does not turn the camera.
    canvas.addEventListener('pointerdown', this.down, { capture: true })
    canvas.addEventListener('pointermove', this.move)
    canvas.addEventListener('pointerup', this.up)
    canvas.addEventListener('pointercancel', this.up)
    canvas.addEventListener('dblclick', ({ offsetX, offsetY }) => {
      const hit = this.at(offsetX, offsetY)
      if (hit) this.objects.select(hit.body.name)
    })
  }

  /** What lies under a point of the canvas, in pixels from its top left. */
  at(x: number, y: number): Hit | null {
    return pick(this.stage.camera, this.lit.bodies, toDevice(this.stage.canvas, x, y))
  }

  private down = (event: PointerEvent): void => {
    if (event.button !== 0) return
    if (!event.isPrimary) {
      if (this.press) this.press.wandered = true // a second finger: this is no click
      return
    }
    const { offsetX: x, offsetY: y } = event
    const hit = this.at(x, y)
    if (!this.objects.gizmo.leavesTo(hit?.body)) return
    this.objects.gizmo.setListening(false)
    this.press = { id: event.pointerId, x, y, hit, wandered: false, shift: event.shiftKey }
    if (hit?.body.userData.info.movable && !this.cameras.flying) this.cameras.orbit.enabled = false
  }

  private move = (event: PointerEvent): void => {
    const { press, objects } = this
    if (!press) {
      this.showCursor(event)
      return
    }
    if (event.pointerId !== press.id) return
    press.wandered ||= Math.hypot(event.offsetX - press.x, event.offsetY - press.y) > CLICK_REACH
    if (!press.wandered || this.cameras.flying || !press.hit?.body.userData.info.movable) return
    if (!objects.gizmo.floorDragging) {
      this.stage.canvas.setPointerCapture(event.pointerId)
      objects.select(press.hit.body.name)
      objects.gizmo.startFloorDrag(press.hit.point)
    }
    objects.gizmo.floorDragTo(toDevice(this.stage.canvas, event.offsetX, event.offsetY))
  }

  private up = (event: PointerEvent): void => {
    const { press } = this
    if (!press || event.pointerId !== press.id) return
    this.press = null
    this.objects.gizmo.endFloorDrag()
    this.objects.gizmo.setListening(true)
    this.cameras.orbit.enabled = !this.cameras.flying
    if (press.wandered || event.type === 'pointercancel' || !press.hit) return
    // Who reads values on walls goes on to move what was selected: that takes a double click to leave.
    const { selected } = this.objects
    const keeps = selected.value !== null && this.objects.isMovable(selected.value)
    if (press.hit.body.userData.info.movable || !keeps) this.objects.select(press.hit.body.name)
    this.probes.pin(press.hit, press.shift)
  }

  private showCursor(event: PointerEvent): void {
    if (event.buttons !== 0) return
    const device = toDevice(this.stage.canvas, event.offsetX, event.offsetY)
    const over = this.objects.gizmo.engaged || pick(this.stage.camera, this.lit.movables, device) !== null
    this.stage.canvas.style.cursor = over ? 'grab' : 'crosshair'
  }
}
