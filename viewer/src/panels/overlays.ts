// SPDX-License-Identifier: Apache-2.0
// What is said over the picture: hint, state of the light, progress, banner of a lost connection.
import { button, h } from '../dom'
import { seconds } from '../format'
import type { Lights } from '../lights'
import type { Objects } from '../objects'
import type { StateMessage } from '../protocol'
import type { RemoteSession } from '../remoteSession'

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
    const task = { bake: 'Baking', check: 'Checking', export: 'Exporting', read: 'Reading' }[progress.task]
    const eta = progress.eta === null ? '' : `, ${seconds(progress.eta)} left`
    const done = `${Math.floor(100 * progress.fraction)} %`
    text.textContent = `${task}: ${progress.stage.replaceAll('_', ' ')}, ${done}${eta}`
    bar.value = progress.fraction
    stop.hidden = progress.task === 'export'
  })
  return element
}

const LIGHT_STATES: Partial<Record<StateMessage['phase'], string>> = {
  empty: 'No light yet',
  preview: 'Preview: fewer paths, noisier light',
  failed: 'The update failed: this light is not up to date',
}

const ALL_OFF = 'No lamp shines: all are off, or removed'
const NO_LIGHT = 'There is no light in this scene: no lamp, no sun, and nothing that glows'
const AT_REST: StateMessage['phase'][] = ['ready', 'updating', 'failed']

/** Mark of a preview, and the way out where there is no light or an older one. */
export function lightState(remote: RemoteSession, lights: Lights, addLamp: () => void): HTMLElement {
  const text = h('span', {})
  const lamp = button('Add a lamp', addLamp, {
    title: 'Where the camera looks, below the ceiling. Everything is baked again.',
  })
  const switchOn = button('Switch them on', () =>
    lights.set(Object.fromEntries(lights.names.map((n) => [n, 1]))),
  )
  const bake = button('Bake', () => void remote.edit({ type: 'bake' }), { class: 'primary' })
  const element = h('div', { class: 'light-state' }, text, bake, switchOn, lamp)
  remote.state.watch((state) => {
    const factors = Object.values(state?.factors ?? {})
    const dark = state?.dark ? (factors.length === 0 ? NO_LIGHT : ALL_OFF) : null
    const said = state && (LIGHT_STATES[state.phase] ?? dark)
    element.hidden = !said
    bake.hidden = said !== LIGHT_STATES.empty && said !== LIGHT_STATES.failed
    switchOn.hidden = said !== ALL_OFF || factors.every((factor) => factor > 0)
    lamp.hidden = said !== NO_LIGHT && said !== ALL_OFF
    lamp.disabled = state !== null && !AT_REST.includes(state.phase) // a bake is at work
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
