// SPDX-License-Identifier: Apache-2.0
// The legend over the picture: colour bar, and fields at its ends in which the range is changed in place.
import { button, h, numberField, show } from '../dom'
import { valueUnit } from '../format'
import { drawLegend, ends, legendText } from '../legend'
import type { Look } from '../look'
import type { Unit } from '../protocol'
import type { ScaledMode } from '../settings'

const MOST_HEIGHT = 340
const MARGIN = 12 // left free below

export interface LegendBox {
  element: HTMLElement
  canvas: HTMLCanvasElement
}

export function legendBox(look: Look, unit: Unit): LegendBox {
  const canvas = h('canvas', { role: 'img' })
  const high = numberField('Upper end of the colours', (value) =>
    look.changeRange({ automatic: false, high: value }),
  )
  const low = numberField('Lower end of the colours', (value) =>
    look.changeRange({ automatic: false, low: value }),
  )
  const automatic = button('Auto', () => look.changeRange({ automatic: true }), {
    title: 'The range of what is seen: 2 % of the picture are beyond either end',
  })
  const element = h('div', { class: 'legend' }, canvas, high, low, automatic)
  const draw = () => {
    const { mode, ranges } = look.settings.value
    const scale = look.scale.value
    element.hidden = scale === null || mode === 'lit'
    const room = element.parentElement?.clientHeight ?? MOST_HEIGHT
    if (!scale || mode === 'lit' || room === 0) return
    const height = Math.min(MOST_HEIGHT, room - MARGIN)
    const title = valueUnit(mode, unit)
    drawLegend(canvas, scale, title, height, window.devicePixelRatio)
    canvas.setAttribute('aria-label', legendText(scale, title))
    high.style.top = `${ends.high}px`
    low.style.bottom = `${ends.low}px`
    low.disabled = scale.diverging
    automatic.setAttribute('aria-pressed', String(ranges[mode as ScaledMode].automatic))
    show(high, scale.high, 6)
    show(low, scale.low, 6)
  }
  look.scale.watch(draw)
  look.settings.watch(draw)
  // The picture's size decides how long the bar may be; the element has a parent by then.
  queueMicrotask(() => new ResizeObserver(draw).observe(element.parentElement!))
  return { element, canvas }
}
