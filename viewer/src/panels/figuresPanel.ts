// SPDX-License-Identifier: Apache-2.0
// Panel of live figures: what the last update cost, what it touched, and the check that it was exact.
import { button, h, panel } from '../dom'
import { count, milliseconds } from '../format'
import type { CheckedMessage, FrameMessage } from '../protocol'
import type { RemoteSession } from '../remoteSession'
import type { Signal } from '../signal'

const STAGE_COLOURS = ['#4f7fbf', '#4fa3a5', '#7fae5c', '#c7a24b', '#c77a4b', '#a86fb0', '#7f8a99']

export function figuresPanel(remote: RemoteSession, latency: Signal<number | null>): HTMLElement {
  const bar = h('div', { class: 'stages', role: 'img' })
  const names = h('div', { class: 'stage-names' }, 'Move something, and this shows what it cost.')
  const table = h('dl', { class: 'figures' })
  const unreached = h('p', {
    class: 'unreached',
    hidden: true,
    title: 'What light paths would bring there is not known; the standard error is a bound of it',
  })
  const result = h('p', { class: 'verdict', role: 'status' })
  const check = button(
    'Check exactness',
    () => {
      result.textContent = ''
      void remote.edit({ type: 'check' })
    },
    { title: 'Recomputes everything from scratch and compares the digests (X)' },
  )
  const refresh = () => {
    const frame = remote.frame.value
    if (!frame) return
    showStages(bar, names, frame.milliseconds)
    table.replaceChildren(
      ...figures(frame, latency.value).flatMap(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]),
    )
  }
  remote.frame.watch(refresh)
  latency.watch(refresh)
  const showUnreached = () => {
    const found = remote.unreached.value
    unreached.hidden = !found?.samples || found.revision !== remote.state.value?.revision
    unreached.textContent = found && unreachedText(found.samples)
  }
  remote.unreached.watch(showUnreached)
  remote.state.watch(showUnreached)
  let revision: number | undefined // of the verdict
  remote.checked.watch((checked) => {
    revision = remote.state.value?.revision
    showVerdict(result, checked)
  })
  remote.state.watch((state) => {
    if (state?.revision !== revision) result.textContent = ''
    check.disabled = !state || ['empty', 'baking', 'preview', 'checking'].includes(state.phase)
  })
  return panel('Live figures', bar, names, table, unreached, h('div', { class: 'row' }, check), result)
}

function figures(frame: FrameMessage, latency: number | null): [string, string][] {
  const total = frame.milliseconds.total ?? sum(frame.milliseconds)
  const rows: [string, string][] = [
    ['Update', milliseconds(total)],
    ['Affected paths', ofAll(frame.affected_paths, frame.paths)],
    ['Re-traced segments', ofAll(frame.retraced_segments, frame.segments)],
    ['Gather rays cast', raysCast(frame)],
    ['Share done', `${Math.floor(100 * frame.done)} %`],
    ['Method, static part', methodName(frame.static_method)],
    ['Method, moving part', methodName(frame.moving_method)],
  ]
  if (frame.recompute_milliseconds !== null)
    rows.push(['Full recompute', milliseconds(frame.recompute_milliseconds)])
  if (frame.speed_up !== null)
    rows.push(['Speed-up', `${frame.speed_up.toFixed(frame.speed_up < 10 ? 1 : 0)} ×`])
  if (latency !== null) rows.push(['Drag to picture', milliseconds(latency)])
  return rows
}

/** What the light does not say about itself: a closed cupboard, too few paths, or nothing that reflects. */
export const unreachedText = (samples: number) =>
  `${count(samples)} ${samples === 1 ? 'sample' : 'samples'} that no path reached`

const methodName = (method: string | null) => method?.replaceAll('_', ' ') ?? 'none'
const sum = (parts: Record<string, number>) => Object.values(parts).reduce((a, b) => a + b, 0)

/** After an update, also how many of the rays met something else: the others were cast in vain. */
function raysCast({ gathered_rays, changed_rays }: FrameMessage): string {
  if (changed_rays === 0) return count(gathered_rays)
  return `${count(gathered_rays)} (${Math.round((100 * changed_rays) / gathered_rays)} % changed)`
}

function ofAll(part: number, whole: number): string {
  const percent = (100 * part) / Math.max(whole, 1)
  return `${count(part)} (${percent.toFixed(percent < 99.95 ? 1 : 0)} %)`
}

function showStages(bar: HTMLElement, names: HTMLElement, times: Record<string, number>): void {
  const stages = Object.entries(times).filter(([name, value]) => name !== 'total' && value > 0)
  const label = (name: string, value: number) => `${name.replaceAll('_', ' ')} ${milliseconds(value)}`
  bar.setAttribute('aria-label', stages.map(([name, value]) => label(name, value)).join(', '))
  const colour = (i: number) => `background:${STAGE_COLOURS[i % STAGE_COLOURS.length]}`
  bar.replaceChildren(
    ...stages.map(([name, value], i) =>
      h('span', { style: `flex-grow:${value};${colour(i)}`, title: label(name, value) }),
    ),
  )
  names.replaceChildren(
    ...stages.map(([name, value], i) => h('span', {}, h('i', { style: colour(i) }), label(name, value))),
  )
}

function showVerdict(element: HTMLElement, checked: CheckedMessage | null): void {
  if (!checked) return
  element.className = checked.same ? 'verdict good' : 'verdict bad'
  element.replaceChildren(
    checked.same ? '✓ Same digest as a recompute' : '✗ The digests differ',
    h('code', { title: checked.digest }, checked.digest.slice(0, 16)),
    ...(checked.same ? [] : [h('code', { title: checked.recomputed }, checked.recomputed.slice(0, 16))]),
  )
}
