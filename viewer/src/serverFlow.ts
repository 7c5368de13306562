// SPDX-License-Identifier: Apache-2.0
// What the server sends, on its way to the screen; frames are acknowledged when they are there.
import { geometryArrays } from './geometry'
import type { Latency } from './latency'
import type { Look } from './look'
import type { Objects } from './objects'
import type { Probes } from './probes'
import type { SceneInfo, StateMessage, ValuesFrame } from './protocol'
import { Remeshing, type Loaded } from './remeshing'
import type { References } from './references'
import type { RemoteSession } from './remoteSession'
import type { LitScene } from './three/litScene'
import type { Stage } from './three/stage'

const LATE = 2000 // milliseconds; shapes without light are drawn if that is not there by then

/** The parts of the page that the server's messages reach. */
export interface Receivers {
  stage: Stage
  lit: LitScene
  remote: RemoteSession
  objects: Objects
  look: Look
  probes: Probes
  references: References
  latency: Latency
}

export class ServerFlow {
  readonly frames: number[] = [] // numbers of those received
  shown = -1 // revision of the light on the screen
  private readonly drawn: ValuesFrame[] = [] // arrived, not yet on the screen
  private revision = -1 // of the newest state
  private atRest = -1 // revision of the light that arrived last, where that is complete
  private lightCame: () => void = () => {}
  private readonly remeshing: Remeshing

  /** `waitForGpu`: acknowledge no frame before the GPU has taken it (measurements want that). */
  constructor(
    private readonly to: Receivers,
    private readonly sceneAddress: string,
    load: (geometry: number) => Promise<Loaded>,
    private readonly waitForGpu: boolean,
  ) {
    const { remote, latency, lit, stage } = to
    this.remeshing = new Remeshing(
      load,
      (loaded) => this.remesh(loaded),
      (frame, remeshed) => this.takeValues(frame, remeshed),
      (frame) => remote.acknowledge(frame.seq),
    )
    remote.onGeometry = (number) => this.remeshing.announce(number, lit.info.geometry)
    remote.onMoved = (sent, revision) => latency.accepted(sent, revision)
    remote.onConnected = () => this.startOver()
    remote.onValues = (frame) => this.remeshing.take(frame)
    remote.state.watch((state) => state && this.takeState(state))
    stage.afterDrawing.push(() => this.acknowledge())
    if (lit.info.lit) void stage.holdUntil(this.light())
  }

  /** Settled when the first light came, or is late. */
  private light(): Promise<void> {
    return new Promise((resolve) => {
      this.lightCame = resolve
      setTimeout(resolve, LATE)
    })
  }

  private startOver(): void {
    this.to.latency.forget()
    this.shown = this.revision = this.atRest = -1
    this.drawn.length = 0
    this.remeshing.startOver()
    this.checkRun().catch(() => {}) // the server is away again, which the connection notices
  }

  private remesh({ info, buffer }: Loaded): void {
    const { lit, look, probes, references, remote, objects } = this.to
    const state = remote.state.value
    probes.over(() => {
      const carrier = lit.remesh(info, geometryArrays(info, buffer), state?.poses ?? {})
      references.carry((kept) => carrier.carry(kept))
      if (state) objects.follow(state) // what can be moved now has a pose
    })
    look.remeshed()
  }

  private takeValues(frame: ValuesFrame, remeshed: boolean): void {
    const { lit, look, probes, references, stage } = this.to
    const first = !lit.values.known
    if (first) performance.mark('values')
    lit.apply(frame)
    this.atRest = frame.rest ? frame.revision : -1
    if (frame.rest && !references.times.value.start) references.keep('start')
    this.frames.push(frame.seq)
    this.drawn.push(frame)
    probes.update()
    const another = frame.rest && (look.dark || look.settings.value.mode === 'difference')
    const metered = (frame.full && !remeshed) || first || another ? look.measureAgain() : null
    if (first && metered) void stage.holdUntil(metered)
    this.lightCame()
    stage.invalidate()
  }

  private takeState(state: StateMessage): void {
    const { objects, lit, references } = this.to
    // An edit begins. What follows at once, before the light has come to rest, is part of it.
    const wasAtRest = this.atRest >= 0 && this.atRest === this.revision
    if (state.revision > this.revision && wasAtRest) references.keep('edit')
    this.revision = state.revision
    objects.follow(state)
    for (const [name, value] of Object.entries(state.reflectances)) {
      lit.materials.setReflectance(name, value)
    }
    lit.materials.setFactors(state.factors)
  }

  /** Frames are on the screen: the server may send more. */
  private acknowledge(): void {
    if (this.drawn.length === 0) return
    const gl = this.to.stage.renderer.getContext()
    const first = this.frames.length === this.drawn.length // its marks tell when it was drawn, on the GPU, too
    if (first) performance.mark('submitted')
    if (this.waitForGpu || first) gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4))
    if (first) performance.mark('lit')
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
    const same = (['name', 'version', 'geometry', 'vertices', 'triangles'] as const).every(
      (key) => served[key] === info[key],
    )
    if (!same) location.reload()
    info.run = served.run
  }
}
