// SPDX-License-Identifier: Apache-2.0
// Bar of the time line: record, play, scrub.
import { button, h } from '../dom'
import type { Timeline } from '../timeline'

export function timelineBar(timeline: Timeline): HTMLElement {
  const record = button('● Record', () => (timeline.recording.value = !timeline.recording.value), {
    class: 'record',
    title: 'Records every drag until it is pressed again',
  })
  const play = button('▶ Play', () => (timeline.playing.value ? timeline.stop() : timeline.play()))
  const clear = button('Clear', () => timeline.clear(), { class: 'bare' })
  const slider = h('input', {
    type: 'range',
    min: 0,
    max: 1,
    step: 'any',
    value: 0,
    'aria-label': 'Time, seconds',
    input: () => timeline.show(slider.valueAsNumber, true),
    change: () => timeline.show(slider.valueAsNumber, false),
  })
  const text = h('output', {})
  const refresh = () => {
    const duration = timeline.duration.value
    slider.max = String(duration || 1)
    slider.value = String(timeline.seconds.value)
    for (const control of [play, slider]) control.disabled = duration === 0
    clear.hidden = duration === 0
    text.textContent = duration
      ? `${timeline.seconds.value.toFixed(1)} / ${duration.toFixed(1)} s`
      : timeline.recording.value
        ? 'Drag an object: its way is recorded'
        : 'Nothing recorded'
  }
  timeline.recording.watch((on) => {
    record.setAttribute('aria-pressed', String(on))
    refresh()
  })
  timeline.playing.watch((on) => (play.textContent = on ? '■ Stop' : '▶ Play'))
  timeline.seconds.watch(refresh)
  timeline.duration.watch(refresh)
  return h(
    'div',
    { class: 'timeline', role: 'group', 'aria-label': 'Time line' },
    record,
    play,
    slider,
    text,
    clear,
  )
}
