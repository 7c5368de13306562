// SPDX-License-Identifier: Apache-2.0
// The canvas and its renderer: draws when something changed, and not otherwise.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  LinearSRGBColorSpace,
  MathUtils,
  Mesh,
  PerspectiveCamera,
  Scene,
  WebGLRenderer,
  type Material,
} from 'three'
import { Smoothing, type Antialiasing } from './smoothing'

const BACKGROUND = 0x30 / 0xff // what pictures show around the scene: linear grey 0.03, encoded
const MOST_ANISOTROPY = 8

export class Stage {
  readonly renderer: WebGLRenderer
  readonly scene = new Scene()
  readonly camera = new PerspectiveCamera(50, 1, 0.01, 1000)
  readonly beforeDrawing: ((seconds: number) => boolean)[] = [] // each tells whether it wants another frame
  readonly overlays: (() => void)[] = [] // drawn over the scene
  readonly afterDrawing: (() => void)[] = []
  pictures = 0 // drawn so far
  private field = 50
  private scheduled = false // something is to be drawn,
  private request = 0 // and the browser was asked for its next turn
  private holds = 0
  private lastTime = 0
  private readonly smoothing: Smoothing | null // of pictures that are not antialiased as they are drawn

  constructor(
    readonly canvas: HTMLCanvasElement,
    antialiasing: Antialiasing,
  ) {
    const antialias = antialiasing === 'always'
    this.renderer = new WebGLRenderer({ canvas, antialias, powerPreference: 'high-performance' })
    this.smoothing = antialiasing === 'at rest' ? new Smoothing(this.renderer, () => this.drawPlain()) : null
    this.renderer.autoClear = false
    // As in targets that are measured, so that both share one program; shaders encode their colours themselves.
    this.renderer.outputColorSpace = LinearSRGBColorSpace
    this.scene.background = new Color().setScalar(BACKGROUND)
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!)
    this.resize()
  }

  get aspect(): number {
    return this.camera.aspect
  }

  /** Field of view, degrees, over the picture's height; where it is upright, over its width. */
  get fieldOfView(): number {
    return this.field
  }

  set fieldOfView(degrees: number) {
    this.field = degrees
    const { camera } = this
    const half = Math.tan(MathUtils.degToRad(degrees) / 2)
    camera.fov = MathUtils.radToDeg(2 * Math.atan(half / Math.min(camera.aspect, 1)))
    camera.updateProjectionMatrix()
    this.invalidate()
  }

  /** Of textures that are seen from aside: more would be too slow where there is no graphics card. */
  get anisotropy(): number {
    return this.smoothing ? 1 : Math.min(this.renderer.capabilities.getMaxAnisotropy(), MOST_ANISOTROPY)
  }

  /** Lets the driver compile a material's program while the page is at work on other things. */
  warmUp(material: Material | undefined): void {
    if (!material) return
    const triangle = new BufferGeometry()
    for (const name of ['position', 'normal']) {
      triangle.setAttribute(name, new BufferAttribute(new Float32Array(9), 3))
    }
    this.renderer.compile(new Mesh(triangle, material), this.camera, this.scene)
  }

  /** Change of depth in clip space over a pixel of a surface at 45 degrees, wherever it is. */
  get depthOfPixel(): number {
    const { fov, near } = this.camera
    return (4 * near * Math.tan(MathUtils.degToRad(fov) / 2)) / this.renderer.domElement.height
  }

  /** Draws once more at the next opportunity. */
  invalidate = (): void => {
    if (this.scheduled) return
    this.scheduled = true
    this.smoothing?.wait()
    this.ask()
  }

  /** Draws nothing until a promise is settled: what would be shown meanwhile is replaced at once. */
  async holdUntil(settled: Promise<unknown>): Promise<void> {
    cancelAnimationFrame(this.request)
    this.holds++
    try {
      await settled
    } finally {
      this.holds--
      if (this.scheduled) this.ask()
    }
  }

  private ask(): void {
    if (this.holds === 0) this.request = requestAnimationFrame(this.draw)
  }

  get idle(): boolean {
    return !this.scheduled && !this.smoothing?.waiting
  }

  /** The picture as it is, at once and as good as can be (readable until the browser's next turn). */
  drawNow(): void {
    if (this.smoothing) this.smoothing.now()
    else this.drawPlain()
  }

  private drawPlain(): void {
    this.renderer.clear()
    this.renderer.render(this.scene, this.camera)
    for (const overlay of this.overlays) overlay()
  }

  private draw = (now: number): void => {
    this.scheduled = false
    const seconds = Math.min((now - this.lastTime) / 1000, 0.1)
    this.lastTime = now
    const again = this.beforeDrawing.map((step) => step(seconds)).some(Boolean)
    this.drawPlain()
    this.pictures++
    for (const step of this.afterDrawing) step()
    if (again) this.invalidate()
    else if (!this.scheduled) this.smoothing?.soon()
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement!
    if (width === 0 || height === 0) return
    this.renderer.setPixelRatio(window.devicePixelRatio)
    this.renderer.setSize(width, height, false)
    this.camera.aspect = width / height
    this.fieldOfView = this.field
  }
}
