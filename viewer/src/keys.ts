// SPDX-License-Identifier: Apache-2.0
// Keys of the page, and the dialog that shows them.
import { button, h } from './dom'

export interface Shortcut {
  keys: string // as shown; empty: not shown
  does: string
  matches(event: KeyboardEvent): boolean
  action(): void
}

/** A shortcut by `KeyboardEvent.key` (letters in lower case), without Ctrl. */
export function plain(key: string, does: string, action: () => void, shown = key.toUpperCase()): Shortcut {
  const matches = (event: KeyboardEvent) =>
    !event.ctrlKey && !event.metaKey && !event.altKey && event.key.toLowerCase() === key
  return { keys: shown, does, matches, action }
}

export function withControl(key: string, shift: boolean, does: string, action: () => void): Shortcut {
  const matches = (event: KeyboardEvent) =>
    (event.ctrlKey || event.metaKey) && event.shiftKey === shift && event.key.toLowerCase() === key
  return { keys: `Ctrl+${shift ? 'Shift+' : ''}${key.toUpperCase()}`, does, matches, action }
}

/** Listens to keys unless the user types; `first` may take one before (flying does). */
export function listen(shortcuts: Shortcut[], first: (code: string, down: boolean) => boolean): void {
  window.addEventListener('keydown', (event) => {
    const plainKey = !event.ctrlKey && !event.metaKey && !event.altKey
    if (typing(event.target, plainKey) || document.querySelector('dialog[open]')) return
    if (plainKey && first(event.code, true)) return
    const shortcut = shortcuts.find((candidate) => candidate.matches(event))
    if (!shortcut) return
    event.preventDefault()
    shortcut.action()
  })
  window.addEventListener('keyup', (event) => first(event.code, false))
}

/** Sliders keep plain keys, such as arrows; what undoes their last step is not for them. */
function typing(target: EventTarget | null, plainKey: boolean): boolean {
  if (target instanceof HTMLInputElement) {
    return target.type === 'range' ? plainKey : target.type !== 'checkbox'
  }
  return target instanceof HTMLSelectElement
}

export function helpDialog(shortcuts: Shortcut[]): HTMLDialogElement {
  const shown = shortcuts.filter(({ keys }) => keys !== '')
  const rows = shown.flatMap(({ keys, does }) => [h('dt', {}, h('kbd', {}, keys)), h('dd', {}, does)])
  const pointer: [string, string][] = [
    ['Drag an object', 'moves it along the floor'],
    ['Drag an arrow or ring', 'moves or turns the selected object'],
    ['Click', 'selects an object, shows the value at the point'],
    ['Shift+click', 'keeps the pins that are there'],
    ['Drag, right drag, wheel', 'orbits, shifts, zooms'],
  ]
  const dialog = h(
    'dialog',
    { 'aria-label': 'Keys' },
    h('h2', {}, 'Keys and pointer'),
    h('dl', {}, ...pointer.flatMap(([what, does]) => [h('dt', {}, what), h('dd', {}, does)]), ...rows),
    button('Close', () => dialog.close(), { class: 'primary' }),
  )
  return dialog
}
