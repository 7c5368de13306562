// SPDX-License-Identifier: Apache-2.0
// The picture as seen, with its legend, as a file.
import { h } from './dom'
import type { LegendBox } from './panels/legendBox'
import type { Stage } from './three/stage'

export function saveScreenshot(
  stage: Stage,
  labels: HTMLCanvasElement,
  legend: LegendBox,
  name: string,
): void {
  stage.drawNow()
  const picture = stage.canvas
  const canvas = h('canvas', { width: picture.width, height: picture.height })
  const context = canvas.getContext('2d')!
  context.drawImage(picture, 0, 0)
  if (labels.width > 1) context.drawImage(labels, 0, 0, picture.width, picture.height)
  if (!legend.element.hidden) context.drawImage(legend.canvas, picture.width - legend.canvas.width, 0)
  canvas.toBlob((blob) => {
    if (!blob) return
    const address = URL.createObjectURL(blob)
    h('a', { href: address, download: name }).click()
    URL.revokeObjectURL(address)
  })
}
