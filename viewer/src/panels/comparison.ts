// SPDX-License-Identifier: Apache-2.0
// The difference view's other side: which state it is, said over the picture and chosen in the panel.
import { button, h } from '../dom'
import type { Look } from '../look'
import { REFERENCES, type Reference, type References } from '../references'

const NAMES: Record<Reference, string> = {
  edit: 'before the last edit',
  start: 'when this page was opened',
  remembered: 'the remembered state',
}

/** What the picture compares with, in a sentence. */
export function comparisonText(reference: Reference, times: Partial<Record<Reference, Date>>): string {
  const time = times[reference]
  if (time && reference === 'edit') return 'Now minus before the last edit'
  const at = time ? ` (${time.toLocaleTimeString()})` : ''
  if (time)
    return `Now minus ${reference === 'start' ? 'the start of this page' : 'the remembered state'}${at}`
  if (reference === 'edit') return 'Nothing was edited yet: move something, and this shows what changed'
  return 'Nothing was remembered: this is the change since the page was opened'
}

export function comparisonNote(look: Look, references: References): HTMLElement {
  const element = h('div', { class: 'comparison', role: 'status' })
  const refresh = () => {
    const { mode, reference } = look.settings.value
    element.hidden = mode !== 'difference'
    element.textContent = comparisonText(reference, references.times.value)
  }
  look.settings.watch(refresh)
  references.times.watch(refresh)
  return element
}

export function comparisonControls(look: Look, references: References, remember: () => void): HTMLElement {
  const options = REFERENCES.map((reference) => h('option', { value: reference }, NAMES[reference]))
  const choice = h(
    'select',
    {
      'aria-label': 'Compare with',
      change: () => look.change({ reference: choice.value as Reference }),
    },
    ...options,
  )
  const element = h(
    'div',
    { class: 'stack' },
    h('label', { class: 'row' }, 'Compare with', choice),
    h(
      'div',
      { class: 'row' },
      button('Remember this state', remember, { title: 'And compare with it from now on (M)' }),
    ),
  )
  look.settings.watch(({ mode, reference }) => {
    element.hidden = mode !== 'difference'
    choice.value = reference
  })
  references.times.watch((times) => {
    options[REFERENCES.indexOf('remembered')].disabled = !times.remembered
  })
  return element
}
