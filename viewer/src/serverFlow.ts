// SPDX-License-Identifier: Apache-2.0
// What the server sends, on its way to the screen; frames are acknowledged when they are there.
import type { Latency } from './latency'
import type { Look } from './look'
import type { Objects } from './objects'
import type { Probes } from './probes'
import type { SceneInfo, StateMessage, ValuesFrame } from './protocol'
import type { RemoteSession } from './remoteSession'
import type { LitScene } from './three/litScene'
import type { Stage } from './three/stage'

/** The parts of the page that the server's messages reach. */
export interface Receivers {
  stage: Stage
  lit: LitScene
  remote: RemoteSession
  objects: Objects
  look: Look
  probes: Probes
  latency: Latency
}

export class ServerFlow {
  readonly frames: number[] = [] // numbers of those received
  shown = -1 // revision of the light on the screen
  private readonly drawn: ValuesFrame[] = [] // arrived, not yet on the screen
  private settled = true

  /** `waitForGpu`: acknowledge no frame before the GPU has taken it (measurements want that). */
  constructor(
    private readonly to: Receivers,
    private readonly sceneAddress: string,
    private readonly waitForGpu: boolean,
  ) {
    const { remote, latency, stage } = to
    remote.onMoved = (sent, revision) => latency.accepted(sent, revision)
    remote.onConnected = () => this.startOver()
    remote.onValues = (frame) => this.takeValues(frame)
    remote.state.watch((state) => state && this.takeState(state))
    stage.afterDrawing.push(() => this.acknowledge())
  }

  private startOver(): void {
    this.to.latency.forget()
    this.shown = -1
    this.drawn.length = 0
    this.checkRun().catch(() => {}) // the server is away again, which the connection notices
  }

  private takeValues(frame: ValuesFrame): void {
    const { lit, look, probes, stage } = this.to
    const first = !lit.values.known
    lit.apply(frame)
    this.frames.push(frame.seq)
    this.drawn.push(frame)
    probes.update()
    if (frame.full || first) void look.lightChanged()
    stage.invalidate()
  }

  private takeState(state: StateMessage): void {
    const { objects, lit, look } = this.to
    objects.follow(state)
    for (const [name, value] of Object.entries(state.reflectances)) {
      lit.materials.setReflectance(name, value)
    }
    const ready = state.phase === 'ready'
    if (ready && !this.settled && look.settings.value.mode === 'difference') void look.lightChanged()
    this.settled = ready
  }

  /** Frames are on the screen: the server may send more. */
  private acknowledge(): void {
    if (this.drawn.length === 0) return
    const gl = this.to.stage.renderer.getContext()
    if (this.waitForGpu) gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4))
    for (const frame of this.drawn) {
      this.shown = frame.revision
      this.to.latency.shown(frame.revision)
      this.to.remote.acknowledge(frame.seq)
    }
    this.drawn.length = 0
  }

  /** After a restart the server may serve another scene: then the page starts over. */
  private async checkRun(): Promise<void> {
    const { info } = this.to.lit
    const served = (await (await fetch(this.sceneAddress)).json()) as SceneInfo
    if (served.run === info.run) return
    const same = (['name', 'vertices', 'triangles'] as const).every((key) => served[key] === info[key])
    if (!same) location.reload()
    info.run = served.run
  }
}
