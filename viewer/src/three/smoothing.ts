// SPDX-License-Identifier: Apache-2.0
// Antialiasing where pictures are drawn in software, which takes twice the time for it: once all is at rest.
import { Vector2, WebGLRenderTarget, type WebGLRenderer } from 'three'
import { screenPass } from './screenPass'

const REST = 300 // milliseconds without a change
const SAMPLES = 4
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i

const fragmentShader = /* glsl */ `
precision highp float;
uniform sampler2D picture;
out vec4 colour;
void main() { colour = texelFetch(picture, ivec2(gl_FragCoord.xy), 0); }`

export type Antialiasing = 'always' | 'at rest' | 'never'

/** Whether the browser has no graphics card to draw with, by the name of what draws. */
export function drawsInSoftware(): boolean {
  const context = document.createElement('canvas').getContext('webgl2')
  if (!context) return false
  const unmasked = context.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL
  const name = String(context.getParameter(unmasked ?? context.RENDERER))
  context.getExtension('WEBGL_lose_context')?.loseContext()
  return SOFTWARE.test(name)
}

export class Smoothing {
  private readonly target = new WebGLRenderTarget(1, 1, { samples: SAMPLES })
  private readonly copy = screenPass(fragmentShader, { picture: { value: this.target.texture } })
  private timer = 0

  /** `draw` draws the picture into whatever target is set. */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly draw: () => void,
  ) {}

  /** A smooth picture is still to come. */
  get waiting(): boolean {
    return this.timer !== 0
  }

  /** Draws smoothly soon, unless it is told to wait. */
  soon(): void {
    this.wait()
    this.timer = setTimeout(() => {
      this.timer = 0
      this.now()
    }, REST)
  }

  wait(): void {
    clearTimeout(this.timer)
    this.timer = 0
  }

  now(): void {
    const { renderer, target } = this
    const size = renderer.getDrawingBufferSize(new Vector2())
    target.setSize(size.x, size.y)
    renderer.setRenderTarget(target)
    this.draw()
    renderer.setRenderTarget(null)
    this.copy.render(renderer)
  }
}
