// SPDX-License-Identifier: Apache-2.0
// The page put together: what the server sends goes to the scene, what the user does goes to the server.
import { Box3, Vector2 } from 'three'
import { h } from './dom'
import { geometryArrays } from './geometry'
import { helpDialog, listen } from './keys'
import { lampPlace } from './lampPlace'
import { Latency } from './latency'
import { Lights } from './lights'
import { Look } from './look'
import { Objects } from './objects'
import { comparisonNote } from './panels/comparison'
import { figuresPanel } from './panels/figuresPanel'
import { filePanel } from './panels/filePanel'
import { header } from './panels/header'
import { lightPanel } from './panels/lightPanel'
import { objectPanel } from './panels/objectPanel'
import { legendBox, type LegendBox } from './panels/legendBox'
import { notes } from './panels/notes'
import { banner, hint, lightState, progressBox } from './panels/overlays'
import { timelineBar } from './panels/timelineBar'
import { viewPanel } from './panels/viewPanel'
import { Pointer } from './pointer'
import { Probes } from './probes'
import { References } from './references'
import type { Loaded } from './remeshing'
import { RemoteSession } from './remoteSession'
import { saveScreenshot } from './screenshot'
import { ServerFlow } from './serverFlow'
import { fromHash } from './settings'
import { shortcuts } from './shortcuts'
import { Cameras } from './three/cameras'
import { LitScene } from './three/litScene'
import { Outline } from './three/outline'
import { clearDistance, pick } from './three/picking'
import type { Antialiasing } from './three/smoothing'
import { Stage } from './three/stage'
import { Timeline } from './timeline'
import { IsolineLabels } from './isolineLabels'
import { keepLink } from './viewLink'

const ACCENT = '#ffb84d'

export interface Options {
  antialiasing: Antialiasing
  bench: boolean // upload everything, draw one triangle
}

export class App {
  readonly stage: Stage
  readonly lit: LitScene
  readonly remote: RemoteSession
  readonly objects: Objects
  readonly references: References
  readonly look: Look
  readonly cameras: Cameras
  readonly probes: Probes
  readonly pointer: Pointer
  readonly timeline: Timeline
  readonly latency = new Latency()
  readonly flow: ServerFlow
  private readonly canvas = h('canvas', { tabindex: 0, 'aria-label': 'The scene. Press ? for keys.' })
  private readonly legend: LegendBox
  readonly labels: IsolineLabels
  private readonly flyButton: HTMLButtonElement
  private readonly help: HTMLDialogElement

  // long: makes the parts of the page, one after the other.
  constructor(
    root: HTMLElement,
    { info, buffer }: Loaded,
    load: (geometry: number) => Promise<Loaded>,
    private readonly token: string,
    socket: string,
    options: Options,
  ) {
    const picture = h('main', {}, this.canvas)
    root.replaceChildren(picture)
    this.stage = new Stage(this.canvas, options.antialiasing)
    this.lit = new LitScene(info, geometryArrays(info, buffer), options.bench, ({ programs }) => {
      for (const material of programs) this.stage.warmUp(material)
    })
    this.stage.scene.add(this.lit.root)
    this.stage.beforeDrawing.push(() => {
      this.lit.materials.shared.depthOfPixel.value = this.stage.depthOfPixel
      return false
    })
    this.remote = new RemoteSession(socket)
    this.cameras = new Cameras(this.stage, this.lit.bounds)
    this.objects = new Objects(this.stage, this.lit, this.remote, new Outline(this.stage, ACCENT))
    this.objects.gizmo.controls.addEventListener('dragging-changed', ({ value }) => {
      this.cameras.orbit.enabled = !value && !this.cameras.flying
    })
    const asked = fromHash(location.hash)
    this.references = new References(this.lit.values)
    this.look = new Look(this.stage, this.lit, this.references, asked.settings, asked.exposure)
    this.probes = new Probes(this.stage, this.lit)
    this.pointer = new Pointer(this.stage, this.lit, this.objects, this.probes, this.cameras)
    this.timeline = new Timeline(this.objects)
    const lights = new Lights(info.groups, this.remote)
    this.lit.version.watch(() => lights.rename(this.lit.info.groups))

    const top = header(info, this.look, this.remote, {
      showCamera: (index) => this.showCamera(index),
      fit: () => this.fit(),
      fly: () => this.fly(),
      help: () => this.help.showModal(),
      drawer: (open) => (root.dataset.drawer = open ? 'open' : 'closed'),
    })
    this.flyButton = top.fly
    const keys = shortcuts(this)
    this.help = helpDialog(keys)
    listen(keys, (code, down) => this.cameras.key(code, down))
    this.legend = legendBox(this.look, info.unit)
    this.labels = new IsolineLabels(this.stage, this.lit, this.look, [this.legend.element])
    picture.append(
      this.labels.canvas,
      this.probes.layer,
      this.legend.element,
      h(
        'div',
        { class: 'over' },
        banner(this.remote),
        lightState(this.remote, lights, () => this.addLamp()),
        progressBox(this.remote),
        hint(this.objects),
        comparisonNote(this.look, this.references),
      ),
      notes(this.remote),
    )
    root.append(
      top.element,
      h(
        'aside',
        { id: 'panels', 'aria-label': 'Panels' },
        objectPanel(this.objects, this.remote, this.look),
        lightPanel(lights),
        viewPanel(this.look, this.references, info.unit, this.lit.factors.any, () => this.remember()),
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

    this.stage.afterDrawing.push(() => void this.loadTextures())
    this.startView(asked.eye)
    this.objects.select(this.objects.names[0] ?? null)
    this.flow = new ServerFlow(this, this.withToken('scene.json'), load, options.bench)
    keepLink(this.stage, this.cameras, this.look)
    this.remote.connect()
  }

  /** After the first picture, which then does not wait for them. */
  private async loadTextures(): Promise<void> {
    const { factors } = this.lit
    if (factors.begun) return
    await factors.load(
      (image) => this.withToken(`textures/${image}`),
      this.stage.anisotropy,
      this.stage.invalidate,
      (reason) => (this.remote.note.value = { kind: 'error', text: `An image cannot be shown: ${reason}` }),
    )
    if (factors.any) await this.look.measureAgain() // what is seen may be unlike the images' means
  }

  /** Hangs a lamp where the camera looks. */
  private addLamp(): void {
    this.lit.root.updateMatrixWorld(true)
    const { camera } = this.stage
    const seen = pick(camera, this.lit.bodies, new Vector2(0, 0))?.point ?? null
    const place = lampPlace(camera.position, seen, this.lit.bounds, (from, way) =>
      clearDistance(this.lit.bodies, from, way),
    )
    void this.remote.edit({ type: 'add_lamp', position: place.toArray() })
  }

  remember(): void {
    if (!this.lit.values.known) return
    this.references.keep('remembered')
    this.look.change({ reference: 'remembered' })
    this.probes.update()
  }

  screenshot(): void {
    saveScreenshot(this.stage, this.labels.canvas, this.legend, `${this.lit.info.name}.png`)
  }

  fit(): void {
    const { body } = this.objects
    const [box, others] = body?.visible
      ? [new Box3().setFromObject(body), this.lit.bodies.filter((other) => other !== body)]
      : [this.lit.bounds, this.lit.bodies]
    this.lit.root.updateMatrixWorld(true)
    this.cameras.fit(box, (from, way) => clearDistance(others, from, way))
    void this.look.measureAgain()
  }

  fly(): void {
    this.cameras.fly(!this.cameras.flying)
    this.flyButton.setAttribute('aria-pressed', String(this.cameras.flying))
  }

  showHelp(): void {
    this.help.showModal()
  }

  private showCamera(index: number): void {
    this.cameras.show(this.lit.info.cameras[index], 1)
    this.lit.root.updateMatrixWorld(true)
    this.stage.camera.updateMatrixWorld(true)
    const ahead = pick(this.stage.camera, this.lit.bodies, new Vector2(0, 0))
    this.cameras.show(this.lit.info.cameras[index], ahead?.distance ?? 1)
    void this.look.measureAgain()
  }

  private startView(eye: ReturnType<typeof fromHash>['eye']): void {
    if (eye) {
      const distance = Math.hypot(...eye.target.map((value, i) => value - eye.pose[12 + i]))
      this.cameras.show(
        { name: 'link', pose: eye.pose, vertical_fov: (eye.verticalFov * Math.PI) / 180 },
        distance || 1,
      )
    } else if (this.lit.info.cameras.length) {
      this.showCamera(0)
    } else {
      this.fit()
    }
  }

  withToken(address: string): string {
    const url = new URL(address, document.baseURI)
    url.searchParams.set('token', this.token)
    return url.href
  }
}
