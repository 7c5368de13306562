// SPDX-License-Identifier: Apache-2.0
// Objects: which one is selected, where each movable one is, and every way of moving one.
import { Matrix4, Vector3 } from 'three'
import type { StateMessage } from './protocol'
import type { RemoteSession } from './remoteSession'
import { Signal } from './signal'
import { Gizmo, type GizmoMode, type Placement } from './three/gizmo'
import type { Body, LitScene } from './three/litScene'
import type { Outline } from './three/outline'
import type { Stage } from './three/stage'

export interface MoveWatcher {
  (name: string, pose: Matrix4, dragging: boolean): void
}

export class Objects {
  readonly selected = new Signal<string | null>(null)
  readonly gizmo: Gizmo
  readonly mode = new Signal<GizmoMode>('translate') // of the gizmo
  readonly placement = new Signal<Placement | null>(null) // of the selected object
  readonly moved: MoveWatcher[] = [] // told of moves made here, not of those from elsewhere
  private readonly heldHere = new Set<string>() // moved by this page, ahead of the server's state

  constructor(
    private readonly stage: Stage,
    private readonly lit: LitScene,
    private readonly remote: RemoteSession,
    outline: Outline,
  ) {
    this.gizmo = new Gizmo(stage, {
      moved: (body: Body, pose: Matrix4, dragging: boolean) => this.send(body.name, pose, dragging),
    })
    this.mode.watch((mode) => this.gizmo.setMode(mode))
    this.selected.watch(() => {
      const { body } = this
      const movable = body && this.isMovable(body.name) ? body : null
      outline.body = body
      this.gizmo.attach(movable)
      this.placement.value = movable && this.gizmo.placement()
      this.stage.invalidate()
    })
    // What could not be moved may be movable now.
    lit.version.watch(() => this.selected.tell())
  }

  /** What is drawn of the selected object. */
  get body(): Body | null {
    return (this.selected.value !== null && this.lit.body(this.selected.value)) || null
  }

  isMovable(name: string): boolean {
    return this.lit.body(name)?.userData.info.movable ?? false
  }

  /** Asks for the bake that lets an object be moved. */
  makeMovable(mesh: string): void {
    void this.remote.edit({ type: 'make_movable', mesh })
  }

  get names(): string[] {
    return this.lit.movables.map((body) => body.name)
  }

  isRemoved(name: string): boolean {
    return this.remote.state.value?.poses[name] === null
  }

  select(name: string | null): void {
    if (name !== this.selected.value) this.selected.value = name
  }

  /** Shows the server's poses, but of the object that this page is moving. */
  follow(state: StateMessage): void {
    if (!this.gizmo.dragging && !this.remote.busyDragging) this.heldHere.clear()
    for (const [name, pose] of Object.entries(state.poses)) {
      if (!this.heldHere.has(name)) this.lit.setPose(name, pose)
    }
    this.gizmo.refresh()
    if (this.gizmo.body) this.placement.value = this.gizmo.placement()
    this.stage.invalidate()
  }

  /** Puts an object at a pose that neither gizmo nor number fields made, as the time line does. */
  moveTo(name: string, pose: Matrix4, dragging: boolean): void {
    this.lit.setPose(name, pose.toArray())
    this.gizmo.refresh()
    this.send(name, pose, dragging)
  }

  place(placement: Placement): void {
    if (this.gizmo.body) this.gizmo.place(placement)
  }

  nudge(way: Vector3): void {
    if (this.gizmo.body?.visible) this.gizmo.nudge(way)
  }

  toggleRemoved(name: string): void {
    if (!this.isMovable(name)) return
    void this.remote.edit({ type: this.isRemoved(name) ? 'add' : 'remove', name })
  }

  private send(name: string, pose: Matrix4, dragging: boolean): void {
    this.heldHere.add(name)
    if (this.gizmo.body?.name === name) this.placement.value = this.gizmo.placement()
    for (const watcher of this.moved) watcher(name, pose, dragging)
    const step = { type: 'move', name, pose: pose.toArray(), dragging } as const
    void this.remote.drag(step).then((answer) => {
      if (answer !== 'waiting' && !answer.accepted && !dragging) this.takeBack(name)
    })
    this.stage.invalidate()
  }

  /** The last step of a drag was refused: back to the server's pose, which ends the drag there, too. */
  private takeBack(name: string): void {
    const state = this.remote.state.value
    if (!state) return
    this.heldHere.clear()
    this.follow(state)
    const pose = state.poses[name]
    if (pose) void this.remote.drag({ type: 'move', name, pose, dragging: false })
  }
}
