// SPDX-License-Identifier: Apache-2.0
// Numbers on isolines: once the picture rests, its values are read back and lines that have room get one.
import { position, ticks } from './colourScale'
import { h } from './dom'
import { tick } from './format'
import type { Look } from './look'
import type { LitScene } from './three/litScene'
import { measure, type Measured } from './three/meter'
import type { Stage } from './three/stage'

const REST = 150 // ms without a new picture before numbers are placed
const CELL = 4 // pixels of the picture for each that is read back
const APART = 54 // pixels between two numbers,
const ALIKE_APART = 240 // and between two of the same line
const MARGIN = 26 // pixels to the picture's border
const MOST_NUMBERS = 40
const ONE_SURFACE = 0.04 // relative step in distance that still is one surface
const STEEPEST = 0.1 // of the value, from one place that is read back to the next: else light jumps there

export interface IsolineLabel {
  value: number
  x: number // of its middle, pixels from the top left
  y: number
}

/** Pixels from the top left. */
export interface Rectangle {
  left: number
  top: number
  right: number
  bottom: number
}

/** Numbers for the ticks that the values pass; best where values change slowly, none in `covered`. */
export function placeLabels(
  { width, height, pixels }: Measured,
  levels: number[],
  cell: number,
  covered: Rectangle[] = [],
): IsolineLabel[] {
  const found: (IsolineLabel & { steepness: number })[] = []
  const at = (x: number, y: number) => 4 * (y * width + x)
  for (let y = 1; y < height - 1; y++) {
    for (let x = 1; x < width - 1; x++) {
      const here = at(x, y)
      for (const there of [at(x + 1, y), at(x, y + 1)]) {
        if (pixels[here + 1] < 0.5 || pixels[there + 1] < 0.5) continue
        if (Math.abs(pixels[there + 2] / pixels[here + 2] - 1) > ONE_SURFACE) continue
        const [a, b] = [pixels[here], pixels[there]]
        const passed = levels.filter((level) => a < level !== b < level)
        if (passed.length !== 1) continue // none, or an edge over which the light jumps
        const steepness = Math.abs(b - a) / passed[0]
        if (steepness > STEEPEST) continue
        found.push({ value: passed[0], x: (x + 0.5) * cell, y: (height - y - 0.5) * cell, steepness })
      }
    }
  }
  found.sort((one, two) => one.steepness - two.steepness)
  const placed: IsolineLabel[] = []
  for (const { value, x, y } of found) {
    if (placed.length === MOST_NUMBERS) break
    if (x < MARGIN || y < MARGIN || x > width * cell - MARGIN || y > height * cell - MARGIN) continue
    if (covered.some((over) => isNear(over, x, y))) continue
    const free = placed.every(
      (other) => Math.hypot(other.x - x, other.y - y) > (other.value === value ? ALIKE_APART : APART),
    )
    if (free) placed.push({ value, x, y })
  }
  return placed
}

function isNear({ left, top, right, bottom }: Rectangle, x: number, y: number): boolean {
  return x > left - MARGIN && x < right + MARGIN && y > top - MARGIN && y < bottom + MARGIN
}

export class IsolineLabels {
  readonly canvas = h('canvas', { class: 'labels', 'aria-hidden': 'true' })
  shown: IsolineLabel[] = []
  private timer = 0
  private turn = 0 // of the newest measurement

  constructor(
    private readonly stage: Stage,
    private readonly lit: LitScene,
    private readonly look: Look,
    private readonly over: Element[], // what lies over the picture
  ) {
    stage.afterDrawing.push(() => this.later())
  }

  private later(): void {
    this.turn++
    window.clearTimeout(this.timer)
    if (this.shown.length > 0) this.draw([])
    if (!this.wanted) return
    this.timer = window.setTimeout(() => void this.place(), REST)
  }

  private get wanted(): boolean {
    const { mode, isolines } = this.look.settings.value
    return isolines && (mode === 'falseColour' || mode === 'error')
  }

  private async place(): Promise<void> {
    const scale = this.look.scale.value
    if (!this.wanted || !scale) return
    const turn = this.turn
    const { clientWidth, clientHeight } = this.stage.canvas
    const [width, height] = [clientWidth, clientHeight].map((size) => Math.max(Math.floor(size / CELL), 1))
    const measured = await measure(this.stage, this.lit, this.look.settings.value.mode, width, height)
    if (turn !== this.turn) return // another picture is there already
    const levels = ticks(scale).filter((value) => position(scale, value) > 0 && position(scale, value) < 1)
    this.draw(placeLabels(measured, levels, CELL, this.covered()))
  }

  private covered(): Rectangle[] {
    const { left: x, top: y } = this.stage.canvas.getBoundingClientRect()
    return this.over.map((element) => {
      const { left, top, right, bottom } = element.getBoundingClientRect()
      return { left: left - x, top: top - y, right: right - x, bottom: bottom - y }
    })
  }

  private draw(labels: IsolineLabel[]): void {
    const ratio = window.devicePixelRatio
    const { clientWidth, clientHeight } = this.stage.canvas
    this.shown = labels
    this.canvas.width = labels.length ? clientWidth * ratio : 1
    this.canvas.height = labels.length ? clientHeight * ratio : 1
    const context = this.canvas.getContext('2d')!
    context.scale(ratio, ratio)
    context.font = '600 11px system-ui, sans-serif'
    context.textAlign = 'center'
    context.textBaseline = 'middle'
    context.lineWidth = 3
    context.lineJoin = 'round'
    context.strokeStyle = '#18181bd0'
    context.fillStyle = '#fff'
    for (const { value, x, y } of labels) {
      context.strokeText(tick(value), x, y)
      context.fillText(tick(value), x, y)
    }
  }
}
