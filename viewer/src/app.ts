// SPDX-License-Identifier: Apache-2.0
// The page put together: what the server sends goes to the scene, what the user does goes to the server.
import { Box3, Vector2 } from 'three'
import { h } from './dom'
import { helpDialog, listen } from './keys'
import { Latency } from './latency'
import { Look } from './look'
import { Objects } from './objects'
import { figuresPanel } from './panels/figuresPanel'
import { filePanel } from './panels/filePanel'
import { header } from './panels/header'
import { lightPanel } from './panels/lightPanel'
import { objectPanel } from './panels/objectPanel'
import { banner, hint, legend, lightState, notes, progressBox } from './panels/overlays'
import { timelineBar } from './panels/timelineBar'
import { viewPanel } from './panels/viewPanel'
import { Pointer } from './pointer'
import { Probes } from './probes'
import type { SceneInfo } from './protocol'
import { RemoteSession } from './remoteSession'
import { saveScreenshot } from './screenshot'
import { ServerFlow } from './serverFlow'
import { fromHash } from './settings'
import { shortcuts } from './shortcuts'
import { Cameras } from './three/cameras'
import { geometryArrays, LitScene } from './three/litScene'
import { Outline } from './three/outline'
import { pick } from './three/picking'
import { Stage } from './three/stage'
import { Timeline } from './timeline'
import { keepLink } from './viewLink'

const ACCENT = '#ffb84d'

export interface Options {
  antialias: boolean
  bench: boolean // upload everything, draw one triangle
}

export class App {
  readonly stage: Stage
  readonly lit: LitScene
  readonly remote: RemoteSession
  readonly objects: Objects
  readonly look: Look
  readonly cameras: Cameras
  readonly probes: Probes
  readonly pointer: Pointer
  readonly timeline: Timeline
  readonly latency = new Latency()
  readonly flow: ServerFlow
  private readonly canvas = h('canvas', { tabindex: 0, 'aria-label': 'The scene. Press ? for keys.' })
  private readonly legend: HTMLCanvasElement
  private readonly flyButton: HTMLButtonElement
  private readonly help: HTMLDialogElement

  constructor(
    root: HTMLElement,
    private readonly info: SceneInfo,
    geometry: ArrayBuffer,
    private readonly token: string,
    socket: string,
    options: Options,
  ) {
    const picture = h('main', {}, this.canvas)
    root.replaceChildren(picture)
    this.stage = new Stage(this.canvas, options.antialias)
    this.lit = new LitScene(info, geometryArrays(info, geometry), options.bench)
    this.stage.scene.add(this.lit.root)
    this.remote = new RemoteSession(socket)
    this.cameras = new Cameras(this.stage, this.lit.bounds)
    this.objects = new Objects(this.stage, this.lit, this.remote, new Outline(this.stage, ACCENT))
    this.objects.gizmo.controls.addEventListener('dragging-changed', ({ value }) => {
      this.cameras.orbit.enabled = !value && !this.cameras.flying
    })
    const asked = fromHash(location.hash)
    this.look = new Look(this.stage, this.lit, asked.settings, asked.exposure)
    this.probes = new Probes(this.stage, this.lit)
    this.pointer = new Pointer(this.stage, this.lit, this.objects, this.probes, this.cameras)
    this.timeline = new Timeline(this.objects)

    const top = header(info, this.look, this.remote, {
      showCamera: (index) => this.showCamera(index),
      fit: () => this.fit(),
      fly: () => this.fly(),
      help: () => this.help.showModal(),
    })
    this.flyButton = top.fly
    const keys = shortcuts(this)
    this.help = helpDialog(keys)
    listen(keys, (code, down) => this.cameras.key(code, down))
    this.legend = legend(this.look, info.unit)
    picture.append(
      this.probes.layer,
      this.legend,
      lightState(this.remote),
      hint(this.objects),
      progressBox(this.remote),
      banner(this.remote),
      notes(this.remote),
    )
    root.append(
      top.element,
      h(
        'aside',
        {},
        objectPanel(this.objects, this.remote, this.look),
        lightPanel(info.groups, this.remote),
        viewPanel(this.look, info.unit, () => this.remember()),
        figuresPanel(this.remote, this.latency.last),
        filePanel(
          this.remote,
          info.name,
          info.folder,
          (address) => this.withToken(address),
          () => this.screenshot(),
        ),
      ),
      timelineBar(this.timeline),
      this.help,
    )

    this.startView(asked.eye)
    this.objects.select(this.objects.names[0] ?? null)
    this.flow = new ServerFlow(this, this.withToken('scene.json'), options.bench)
    keepLink(this.stage, this.cameras, this.look)
    this.remote.connect()
  }

  remember(): void {
    this.lit.remember()
    void this.look.lightChanged()
    this.probes.update()
  }

  screenshot(): void {
    saveScreenshot(this.stage, this.legend, `${this.info.name}.png`)
  }

  fit(): void {
    const body = this.objects.gizmo.body
    this.cameras.fit(body?.visible ? new Box3().setFromObject(body) : undefined)
  }

  fly(): void {
    this.cameras.fly(!this.cameras.flying)
    this.flyButton.setAttribute('aria-pressed', String(this.cameras.flying))
  }

  showHelp(): void {
    this.help.showModal()
  }

  private showCamera(index: number): void {
    this.cameras.show(this.info.cameras[index], 1)
    this.lit.root.updateMatrixWorld(true)
    this.stage.camera.updateMatrixWorld(true)
    const ahead = pick(this.stage.camera, this.lit.bodies, new Vector2(0, 0))
    this.cameras.show(this.info.cameras[index], ahead?.distance ?? 1)
    if (this.look.settings.value.automaticExposure) void this.look.meter()
  }

  private startView(eye: ReturnType<typeof fromHash>['eye']): void {
    if (eye) {
      const distance = Math.hypot(...eye.target.map((value, i) => value - eye.pose[12 + i]))
      this.cameras.show(
        { name: 'link', pose: eye.pose, vertical_fov: (eye.verticalFov * Math.PI) / 180 },
        distance || 1,
      )
    } else if (this.info.cameras.length) {
      this.showCamera(0)
    } else {
      this.cameras.fit()
    }
  }

  withToken(address: string): string {
    const url = new URL(address, document.baseURI)
    url.searchParams.set('token', this.token)
    return url.href
  }
}
