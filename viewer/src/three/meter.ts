// SPDX-License-Identifier: Apache-2.0
// Exposure meter: what python/deltalux/outputs/tone.py does with a picture, over a small one of this view.
import { FloatType, WebGLRenderTarget } from 'three'
import { percentile } from '../percentile'
import type { LitScene } from './litScene'
import { MODES } from './materials'
import type { Stage } from './stage'

const WIDTH = 96
const HEIGHT = 60
const KEY = 0.32 // where the typical luminance lands before the tone curve

/** Factor that brings the typical (log-average) luminance of the view to a middle tone; null in the dark. */
export async function measureExposure(stage: Stage, lit: LitScene): Promise<number | null> {
  const { renderer } = stage
  const target = new WebGLRenderTarget(WIDTH, HEIGHT, { type: FloatType })
  const mode = lit.materials.shared.mode
  const [shown, background] = [mode.value, stage.scene.background]
  const hidden = stage.scene.children.filter((child) => child !== lit.root && child.visible)
  const pixels = new Float32Array(4 * WIDTH * HEIGHT)
  for (const child of hidden) child.visible = false
  mode.value = MODES.meter
  stage.scene.background = null
  renderer.setRenderTarget(target)
  renderer.clear()
  renderer.render(stage.scene, stage.camera)
  renderer.setRenderTarget(null)
  mode.value = shown
  stage.scene.background = background
  for (const child of hidden) child.visible = true
  await renderer.readRenderTargetPixelsAsync(target, 0, 0, WIDTH, HEIGHT, pixels)
  target.dispose()
  const luminance: number[] = []
  for (let i = 0; i < pixels.length; i += 4) if (pixels[i + 1] > 0.5) luminance.push(pixels[i])
  return automaticExposure(luminance)
}

export function automaticExposure(luminance: number[]): number | null {
  const lit = luminance.filter((value) => value > 0).sort((a, b) => a - b)
  if (lit.length === 0) return null
  // Deep shadow must not make the rest white: it counts as a hundredth of the bright parts.
  const floor = 0.01 * percentile(lit, 0.9)
  const sum = luminance.reduce((total, value) => total + Math.log(Math.max(value, floor)), 0)
  return KEY / Math.exp(sum / luminance.length)
}
