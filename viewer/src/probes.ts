// SPDX-License-Identifier: Apache-2.0
// Pins that show the value at a point of a surface, with its standard error, and follow light and camera.
import { Vector3 } from 'three'
import { button, h } from './dom'
import { number, unitLabel } from './format'
import type { LitScene } from './three/litScene'
import { hitAgain, placeOf, type Hit } from './three/picking'
import type { Stage } from './three/stage'

export interface Reading {
  value: number // photopic, in the scene's unit
  error: number // its standard error
  change: number | null // since the state that is compared with
}

interface Pin {
  hit: Hit
  element: HTMLElement
  text: HTMLElement
  free: boolean // the next click takes it along
}

export class Probes {
  readonly layer = h('div', { class: 'pins' })
  private pins: Pin[] = []

  constructor(
    private readonly stage: Stage,
    private readonly lit: LitScene,
  ) {
    stage.afterDrawing.push(() => this.place())
  }

  /** What the picture shows at a hit, interpolated in its triangle; null without samples. */
  read(hit: Hit): Reading | null {
    const { values } = this.lit
    if (!hit.sampled || !values.known) return null
    const mean = (of: (vertex: number) => number) =>
      hit.vertices.reduce((sum, vertex, i) => sum + hit.weights[i] * of(vertex), 0)
    const changes = hit.vertices.map((vertex) => values.change(vertex))
    return {
      value: mean((vertex) => values.photopic(vertex)),
      error: mean((vertex) => values.standardError(vertex)),
      change: changes.includes(null)
        ? null
        : changes.reduce<number>((sum, v, i) => sum + hit.weights[i] * v!, 0),
    }
  }

  /** Shows the value at a hit; `keep`: beside the pins that are there. */
  pin(hit: Hit, keep: boolean): void {
    if (!keep) for (const pin of this.pins.filter((pin) => pin.free)) this.remove(pin)
    const text = h('span', { role: 'status' })
    const element = h('div', { class: 'pin' }, text)
    const pin: Pin = { hit, element, text, free: !keep }
    element.append(button('×', () => this.remove(pin), { 'aria-label': 'Remove this pin', class: 'bare' }))
    this.pins.push(pin)
    this.layer.append(element)
    this.update()
    this.stage.invalidate()
  }

  clear(): void {
    for (const pin of [...this.pins]) this.remove(pin)
  }

  /** Reads all pins again. */
  update(): void {
    for (const { hit, text } of this.pins) {
      const reading = this.read(hit)
      const unit = unitLabel(this.lit.info.unit)
      text.replaceChildren()
      if (!reading) {
        text.append(this.lit.values.known ? 'not sampled on this side' : 'no light yet')
        continue
      }
      text.append(
        h('b', {}, number(reading.value)),
        ` ± ${number(reading.error, 2)} ${unit}${percent(reading)}`,
      )
      if (reading.change) text.append(h('i', {}, `${reading.change > 0 ? '+' : ''}${number(reading.change)}`))
    }
  }

  /** The bodies get other triangles by `change`: pins stay where they are. */
  over(change: () => void): void {
    const pins = this.pins.map((pin) => ({ pin, place: placeOf(pin.hit) }))
    change()
    this.lit.root.updateMatrixWorld(true)
    pins.forEach(({ pin, place }) => {
      const hit = hitAgain(pin.hit, place)
      if (hit) pin.hit = hit
      else this.remove(pin)
    })
  }

  private remove(pin: Pin): void {
    pin.element.remove()
    this.pins = this.pins.filter((other) => other !== pin)
  }

  private place(): void {
    const { clientWidth: width, clientHeight: height } = this.stage.canvas
    for (const { hit, element } of this.pins) {
      const at = hit.body.localToWorld(hit.local.clone()).project(this.stage.camera)
      const seen = hit.body.visible && Math.abs(at.z) < 1 && new Vector3(at.x, at.y, 0).length() < 2
      element.hidden = !seen
      element.style.transform = `translate(${((at.x + 1) / 2) * width}px, ${((1 - at.y) / 2) * height}px)`
    }
  }
}

function percent({ value, error }: Reading): string {
  return value > 0 ? ` (${number((100 * error) / value, 2)} %)` : ''
}
