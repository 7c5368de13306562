// SPDX-License-Identifier: Apache-2.0
// Panel of what is shown: exposure of the lit picture, range of the colour scales, what changes are counted from.
import { button, checkbox, h, numberField, panel, show } from '../dom'
import { number, valueUnit } from '../format'
import type { Look } from '../look'
import type { Unit } from '../protocol'
import type { References } from '../references'
import { comparisonControls } from './comparison'

/** `textured`: the scene has textures. */
export function viewPanel(
  look: Look,
  references: References,
  unit: Unit,
  textured: boolean,
  remember: () => void,
): HTMLElement {
  return panel(
    'View',
    exposureControls(look, textured),
    rangeControls(look, unit),
    comparisonControls(look, references, remember),
  )
}

function exposureControls(look: Look, textured: boolean): HTMLElement {
  const text = h('output', {})
  const slider = h('input', {
    type: 'range',
    min: -6,
    max: 6,
    step: 0.1,
    'aria-label': 'Exposure in stops',
    input: () => look.change({ stops: slider.valueAsNumber }),
  })
  const [automatic, input] = checkbox('Automatic', (on) => {
    look.change({ automaticExposure: on })
    if (on) void look.meter()
  })
  const meter = button(
    'Meter this view',
    () => {
      look.change({ stops: 0 })
      void look.meter()
    },
    { title: 'Sets the exposure by what is seen now' },
  )
  const [textures, texturesInput] = checkbox('Textures', (on) => {
    look.change({ textures: on })
    void look.measureAgain()
  })
  textures.hidden = !textured
  const element = h(
    'div',
    { class: 'stack' },
    h('div', { class: 'dimmer' }, h('span', {}, 'Exposure'), text, slider),
    h('div', { class: 'row' }, automatic, textures, meter),
  )
  look.settings.watch((settings) => {
    element.hidden = settings.mode !== 'lit'
    input.checked = settings.automaticExposure
    texturesInput.checked = settings.textures
    slider.value = String(settings.stops)
    text.textContent = `${settings.stops > 0 ? '+' : ''}${number(settings.stops, 2)} stops`
  })
  return element
}

function rangeControls(look: Look, unit: Unit): HTMLElement {
  const low = numberField('', (value) => look.changeRange({ automatic: false, low: value }))
  const high = numberField('', (value) => look.changeRange({ automatic: false, high: value }))
  const title = h('span', {})
  const [automatic, automaticInput] = checkbox('Automatic', (on) => look.changeRange({ automatic: on }))
  const [log, logInput] = checkbox('Logarithmic', (on) => look.changeRange({ logarithmic: on }))
  const [lines, linesInput] = checkbox('Isolines', (on) => look.change({ isolines: on }))
  const element = h(
    'div',
    { class: 'stack' },
    h('div', { class: 'axes' }, title, low, high),
    h('div', { class: 'row' }, automatic, log, lines),
  )
  const refresh = () => {
    const { mode, ranges, isolines } = look.settings.value
    const scale = look.scale.value
    element.hidden = mode === 'lit'
    linesInput.checked = isolines
    if (mode === 'lit' || !scale) return
    const shown = valueUnit(mode, unit)
    title.textContent = `Range, ${shown}`
    low.setAttribute('aria-label', `From, ${shown}`)
    high.setAttribute('aria-label', `To, ${shown}`)
    automaticInput.checked = ranges[mode].automatic
    logInput.checked = scale.logarithmic
    log.hidden = lines.hidden = mode === 'difference'
    low.disabled = mode === 'difference'
    show(low, scale.low, 6)
    show(high, scale.high, 6)
  }
  look.settings.watch(refresh)
  look.scale.watch(refresh)
  return element
}
