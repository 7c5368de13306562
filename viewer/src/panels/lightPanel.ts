// SPDX-License-Identifier: Apache-2.0
// Panel of the light groups: a dimmer for each, linear or by powers of two, at work while it is moved.
import { button, checkbox, h, panel } from '../dom'
import type { RemoteSession } from '../remoteSession'

const STEPS = 1000
const BRIGHTEST = 2 // times the loaded power, at the end of the slider
const DARKEST_STOP = -8 // stops above off, on the logarithmic slider

/** Factor at a place 0 … 1 of the slider. */
export function factorAt(place: number, logarithmic: boolean): number {
  if (place <= 0) return 0
  const top = Math.log2(BRIGHTEST)
  return logarithmic ? 2 ** (DARKEST_STOP + place * (top - DARKEST_STOP)) : place * BRIGHTEST
}

export function placeOf(factor: number, logarithmic: boolean): number {
  if (factor <= 0) return 0
  const top = Math.log2(BRIGHTEST)
  const place = logarithmic ? (Math.log2(factor) - DARKEST_STOP) / (top - DARKEST_STOP) : factor / BRIGHTEST
  return Math.min(Math.max(place, 0), 1)
}

export function lightPanel(groups: string[], remote: RemoteSession): HTMLElement {
  let logarithmic = false
  const factors = new Map<string, number>(groups.map((group) => [group, 1]))
  const held = new Set<string>() // sliders that the user holds
  const rows = groups.map((group) => {
    const text = h('output', {})
    const send = (factor: number, dragging: boolean) => {
      factors.set(group, factor)
      text.textContent = percent(factor)
      void remote.drag({ type: 'dim', group, factor, dragging })
    }
    const slider = h('input', {
      type: 'range',
      min: 0,
      max: STEPS,
      'aria-label': `Light of ${group}`,
      'data-group': group,
      input: () => {
        held.add(group)
        send(rounded(factorAt(Number(slider.value) / STEPS, logarithmic)), true)
      },
      change: () => {
        held.delete(group)
        send(rounded(factorAt(Number(slider.value) / STEPS, logarithmic)), false)
      },
    })
    const reset = button('Reset', () => send(1, false), {
      class: 'bare',
      'aria-label': `Reset the light of ${group}`,
      title: 'As loaded',
    })
    const refresh = () => {
      const factor = factors.get(group) ?? 1
      if (!held.has(group)) slider.value = String(Math.round(STEPS * placeOf(factor, logarithmic)))
      text.textContent = percent(factor)
      slider.setAttribute('aria-valuetext', percent(factor))
    }
    return { element: h('div', { class: 'dimmer' }, h('span', {}, group), text, reset, slider), refresh }
  })
  const [log] = checkbox('Sliders by stops', (on) => {
    logarithmic = on
    for (const row of rows) row.refresh()
  })
  remote.state.watch((state) => {
    for (const [group, factor] of Object.entries(state?.factors ?? {})) {
      if (!held.has(group)) factors.set(group, factor)
    }
    for (const row of rows) row.refresh()
  })
  return panel('Lights', ...rows.map((row) => row.element), log)
}

const percent = (factor: number) => `${Number((100 * factor).toFixed(factor < 0.1 ? 1 : 0))} %`
const rounded = (factor: number) => Number(factor.toPrecision(4))
