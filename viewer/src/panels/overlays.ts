// SPDX-License-Identifier: Apache-2.0
// What lies over the picture: legend, hint, progress, banner of a lost connection, notes.
import { button, h } from '../dom'
import { seconds, unitLabel } from '../format'
import { drawLegend, legendText } from '../legend'
import type { Look } from '../look'
import type { Objects } from '../objects'
import type { Phase, Unit } from '../protocol'
import type { RemoteSession } from '../remoteSession'

const NOTE_SECONDS = 8
const LEGEND_HEIGHT = 320

/** Banner while the server is away. */
export function banner(remote: RemoteSession): HTMLElement {
  const element = h(
    'div',
    { class: 'banner', role: 'alert' },
    'The server is away. Trying to reach it again …',
  )
  remote.link.watch((link) => (element.hidden = link !== 'lost'))
  return element
}

/** Long work: what, how far, how long still, and a way to stop it. */
export function progressBox(remote: RemoteSession): HTMLElement {
  const text = h('span', { role: 'status' })
  const bar = h('progress', { max: 1, 'aria-label': 'Progress' })
  const stop = button('Cancel', () => void remote.edit({ type: 'cancel' }))
  const element = h('div', { class: 'progress' }, text, bar, stop)
  remote.progress.watch((progress) => {
    element.hidden = progress === null
    if (!progress) return
    const task = { bake: 'Baking', check: 'Checking', export: 'Exporting' }[progress.task]
    const eta = progress.eta === null ? '' : `, ${seconds(progress.eta)} left`
    const done = `${Math.floor(100 * progress.fraction)} %`
    text.textContent = `${task}: ${progress.stage.replaceAll('_', ' ')}, ${done}${eta}`
    bar.value = progress.fraction
    stop.hidden = progress.task === 'export'
  })
  return element
}

const LIGHT_STATES: Partial<Record<Phase, string>> = {
  empty: 'No light yet',
  preview: 'Preview: fewer paths, noisier light',
  failed: 'The update failed: this light is not up to date',
}

/** Mark of a preview, and the way out where there is no light or an older one. */
export function lightState(remote: RemoteSession): HTMLElement {
  const text = h('span', {})
  const bake = button('Bake', () => void remote.edit({ type: 'bake' }), { class: 'primary' })
  const element = h('div', { class: 'light-state' }, text, bake)
  remote.state.watch((state) => {
    const said = state && LIGHT_STATES[state.phase]
    element.hidden = !said
    bake.hidden = state?.phase === 'preview'
    text.textContent = said ?? ''
  })
  return element
}

/** What a new user can do first; goes away with the first move. */
export function hint(objects: Objects): HTMLElement {
  const name = objects.names[0]
  const element = h(
    'div',
    { class: 'hint', hidden: name === undefined },
    h('span', {}, 'Drag ', h('b', {}, name ?? ''), ', or one of its arrows: the light follows.'),
    button('×', () => (element.hidden = true), { class: 'bare', 'aria-label': 'Close the hint' }),
  )
  objects.moved.push(() => (element.hidden = true))
  return element
}

/** Notices and refusals, for a while. */
export function notes(remote: RemoteSession): HTMLElement {
  const element = h('div', { class: 'notes', 'aria-live': 'polite' })
  remote.note.watch((note) => {
    if (!note) return
    const item = h('div', { class: `note ${note.kind}` }, note.text)
    for (const old of [...element.children]) if (old.textContent === note.text) old.remove()
    element.append(item)
    window.setTimeout(() => item.remove(), 1000 * NOTE_SECONDS)
  })
  return element
}

export function legend(look: Look, unit: Unit): HTMLCanvasElement {
  const canvas = h('canvas', { class: 'legend', role: 'img' })
  look.scale.watch((scale) => {
    canvas.hidden = scale === null
    if (!scale) return
    drawLegend(canvas, scale, unitLabel(unit), LEGEND_HEIGHT, window.devicePixelRatio)
    canvas.setAttribute('aria-label', legendText(scale, unitLabel(unit)))
  })
  return canvas
}
