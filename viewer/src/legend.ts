// SPDX-License-Identifier: Apache-2.0
// Colour bar with ticks and unit, as an element and for pictures that are saved.
import { colourTable, DIVERGING, position, SEQUENTIAL, ticks, type ColourScale } from './colourScale'
import { tick } from './format'

const WIDTH = 108
const BAR = 16
const LINE = 15 // pixels that a label needs
const FIELD = 24 // of the range, at either end
const TOP = 34 + FIELD
const MARGIN = 12

const tables = {
  sequential: srgbTable(colourTable(SEQUENTIAL)),
  diverging: srgbTable(colourTable(DIVERGING)),
}

function srgbTable(linear: Float32Array): Uint8ClampedArray {
  return Uint8ClampedArray.from(linear, (v, i) =>
    i % 4 === 3 ? 255 : 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055),
  )
}

/** Where the fields of the range stand: pixels from the top, and from the bottom. */
export const ends = {
  high: 30,
  low: MARGIN / 2,
}

/** Draws the legend; the canvas gets its size. */
export function drawLegend(
  canvas: HTMLCanvasElement,
  scale: ColourScale,
  title: string,
  height: number,
  ratio: number,
): void {
  canvas.width = WIDTH * ratio
  canvas.height = height * ratio
  canvas.style.width = `${WIDTH}px`
  canvas.style.height = `${height}px`
  const context = canvas.getContext('2d')!
  context.scale(ratio, ratio)
  context.fillStyle = '#18181be8'
  context.fillRect(0, 0, WIDTH, height)
  const table = scale.diverging ? tables.diverging : tables.sequential
  const length = height - TOP - MARGIN - FIELD
  for (let y = 0; y < length * ratio; y++) {
    const entry = 4 * Math.round((1 - (y + 0.5) / (length * ratio)) * 255)
    context.fillStyle = `rgb(${table[entry]} ${table[entry + 1]} ${table[entry + 2]})`
    context.fillRect(MARGIN, TOP + y / ratio, BAR, 1 / ratio + 0.02)
  }
  context.fillStyle = context.strokeStyle = '#e8e8ea'
  context.font = '600 12px system-ui, sans-serif'
  context.textBaseline = 'middle'
  context.fillText(title, MARGIN, 16)
  context.font = '12px system-ui, sans-serif'
  let last = Infinity
  for (const value of ticks(scale)) {
    const y = TOP + (1 - position(scale, value)) * length
    context.fillRect(MARGIN + BAR, y - 0.5, 4, 1)
    if (last - y < LINE) continue // a label that would touch the last one is left out
    context.fillText(tick(value, scale.diverging), MARGIN + BAR + 7, y)
    last = y
  }
}

/** What the legend says, for those who do not see it. */
export function legendText(scale: ColourScale, title: string): string {
  const kind = scale.logarithmic ? 'logarithmic' : 'linear'
  return `Colour scale, ${title}, ${kind}, from ${tick(scale.low)} to ${tick(scale.high)}`
}
