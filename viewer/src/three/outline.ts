// SPDX-License-Identifier: Apache-2.0
// A line around the selected object: its silhouette drawn into a mask, the mask's border over the picture.
// The object's own colours stay as they are, which false colours need.
import {
  Box2,
  Color,
  DoubleSide,
  Mesh,
  MeshBasicMaterial,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderTarget,
} from 'three'
import type { FullScreenQuad } from 'three/addons/postprocessing/Pass.js'
import type { Body } from './litScene'
import { screenPass } from './screenPass'
import type { Stage } from './stage'

const WIDTH = 2 // pixels

const fragmentShader = /* glsl */ `
precision highp float;
in vec2 place;
uniform sampler2D mask;
uniform vec2 pixel;
uniform vec3 line;
out vec4 colour;
void main() {
  if (texture(mask, place).r > 0.5) discard;
  float near = 0.0;
  for (int i = 0; i < 12; i++) {
    float angle = float(i) * 0.5235987756;
    near = max(near, texture(mask, place + pixel * vec2(cos(angle), sin(angle))).r);
  }
  if (near < 0.5) discard;
  colour = vec4(line, 1.0);
}`

export class Outline {
  body: Body | null = null
  private readonly mask = new WebGLRenderTarget(1, 1, { depthBuffer: false })
  private readonly white = new MeshBasicMaterial({
    color: 0xffffff,
    side: DoubleSide,
    depthTest: false,
    toneMapped: false,
  })
  private readonly silhouette = new Scene()
  private readonly pixel = new Vector2()
  private readonly border: FullScreenQuad

  constructor(
    private readonly stage: Stage,
    accent: string,
  ) {
    this.border = screenPass(fragmentShader, {
      mask: { value: this.mask.texture },
      pixel: { value: this.pixel },
      line: { value: new Color(accent).convertLinearToSRGB() },
    })
    stage.overlays.push(() => this.draw())
  }

  private draw(): void {
    const { body, stage } = this
    if (!body?.visible) return
    const { renderer } = stage
    const size = renderer.getDrawingBufferSize(new Vector2())
    this.mask.setSize(size.x, size.y)
    this.pixel.set(WIDTH / size.x, WIDTH / size.y).multiplyScalar(renderer.getPixelRatio())
    const shape = new Mesh(body.geometry, this.white)
    shape.matrixAutoUpdate = false
    shape.matrix.copy(body.matrix)
    this.silhouette.clear().add(shape)
    const clear = renderer.getClearColor(new Color())
    const alpha = renderer.getClearAlpha()
    const picture = renderer.getRenderTarget()
    renderer.setRenderTarget(this.mask)
    renderer.setClearColor(0, 1)
    renderer.clear()
    renderer.render(this.silhouette, stage.camera)
    renderer.setRenderTarget(picture)
    renderer.setClearColor(clear, alpha)
    const around = this.rectangle(body)
    if (around.isEmpty()) return
    // Only around the object: a pass over all pixels is what software rendering has no time for.
    renderer.setScissor(around.min.x, around.min.y, around.max.x - around.min.x, around.max.y - around.min.y)
    renderer.setScissorTest(true)
    this.border.render(renderer)
    renderer.setScissorTest(false)
  }

  /** Pixels, from the bottom left, that the line can be in. */
  private rectangle(body: Body): Box2 {
    const { camera, canvas } = this.stage
    const whole = new Box2(new Vector2(), new Vector2(canvas.clientWidth, canvas.clientHeight))
    body.geometry.computeBoundingBox()
    const { min, max } = body.geometry.boundingBox!
    const around = new Box2()
    for (let corner = 0; corner < 8; corner++) {
      const at = new Vector3(
        corner & 1 ? max.x : min.x,
        corner & 2 ? max.y : min.y,
        corner & 4 ? max.z : min.z,
      )
      at.applyMatrix4(body.matrix).applyMatrix4(camera.matrixWorldInverse)
      if (at.z > -camera.near) return whole // reaches behind the eye
      at.applyMatrix4(camera.projectionMatrix)
      around.expandByPoint(
        new Vector2((0.5 + 0.5 * at.x) * canvas.clientWidth, (0.5 + 0.5 * at.y) * canvas.clientHeight),
      )
    }
    return around.expandByScalar(2 * WIDTH).intersect(whole)
  }
}
