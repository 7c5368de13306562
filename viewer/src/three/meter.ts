// SPDX-License-Identifier: Apache-2.0
// What is seen, in numbers: the exposure (as python/deltalux/outputs/tone.py meters a picture), ranges, isolines.
import { FloatType, WebGLRenderTarget } from 'three'
import { percentile } from '../percentile'
import type { LitScene } from './litScene'
import { MODES, type ShaderMode } from './materials'
import type { Stage } from './stage'

const WIDTH = 96
const HEIGHT = 60
const KEY = 0.32 // where the typical luminance lands before the tone curve

/** What the pixels of a small picture of this view show, row by row from the bottom. */
export interface Measured {
  width: number
  height: number
  /** Four for each pixel: the value, 1 where it counts (less: a light source), distance along the view, 1. */
  pixels: Float32Array
}

/** Draws the values that a mode shows, without colours; the caller reads them and lets go of the target. */
function drawValues(stage: Stage, lit: LitScene, mode: ShaderMode, target: WebGLRenderTarget): void {
  const { renderer } = stage
  const { shared } = lit.materials
  const [shown, background] = [shared.mode.value, stage.scene.background]
  const hidden = stage.scene.children.filter((child) => child !== lit.root && child.visible)
  for (const child of hidden) child.visible = false
  shared.mode.value = MODES[mode]
  shared.measuring.value = true
  // Texels as the picture shows them, and not the means of many.
  shared.sharpening.value = Math.log2(Math.max(renderer.domElement.height / target.height, 1))
  stage.scene.background = null
  renderer.setRenderTarget(target)
  renderer.clear()
  renderer.render(stage.scene, stage.camera)
  renderer.setRenderTarget(null)
  shared.mode.value = shown
  shared.measuring.value = false
  shared.sharpening.value = 0
  stage.scene.background = background
  for (const child of hidden) child.visible = true
}

export async function measure(
  stage: Stage,
  lit: LitScene,
  mode: ShaderMode,
  width = WIDTH,
  height = HEIGHT,
): Promise<Measured> {
  const target = new WebGLRenderTarget(width, height, { type: FloatType })
  drawValues(stage, lit, mode, target)
  const pixels = new Float32Array(4 * width * height)
  await stage.renderer.readRenderTargetPixelsAsync(target, 0, 0, width, height, pixels)
  target.dispose()
  return { width, height, pixels }
}

/** The values that are seen, as many as they take of the picture's area; at once, which stalls the GPU. */
export function seenValues(stage: Stage, lit: LitScene, mode: ShaderMode): Float32Array {
  const target = new WebGLRenderTarget(WIDTH, HEIGHT, { type: FloatType })
  drawValues(stage, lit, mode, target)
  const pixels = new Float32Array(4 * WIDTH * HEIGHT)
  stage.renderer.readRenderTargetPixels(target, 0, 0, WIDTH, HEIGHT, pixels)
  target.dispose()
  return counted(pixels)
}

/**
 * Factor that brings the typical (log-average) luminance of the view to a middle tone; null in the dark.
 * Light sources are left out, unless nothing else is lit.
 */
export async function measureExposure(stage: Stage, lit: LitScene): Promise<number | null> {
  const { pixels } = await measure(stage, lit, 'lit')
  const others = counted(pixels)
  return automaticExposure([...(others.some((value) => value > 0) ? others : counted(pixels, 0))])
}

/** The values of the pixels that count more than `least`. */
function counted(pixels: Float32Array, least = 0.5): Float32Array {
  const values: number[] = []
  for (let i = 0; i < pixels.length; i += 4) if (pixels[i + 1] > least) values.push(pixels[i])
  return Float32Array.from(values)
}

export function automaticExposure(luminance: number[]): number | null {
  const lit = luminance.filter((value) => value > 0).sort((a, b) => a - b)
  if (lit.length === 0) return null
  // Deep shadow must not make the rest white: it counts as a hundredth of the bright parts.
  const floor = 0.01 * percentile(lit, 0.9)
  const sum = luminance.reduce((total, value) => total + Math.log(Math.max(value, floor)), 0)
  return KEY / Math.exp(sum / luminance.length)
}
