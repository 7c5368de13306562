// SPDX-License-Identifier: Apache-2.0
// Notices and refusals: a few at a time, each long enough to be read; the others wait for their turn.
// Errors stay until they are closed, or others need the room.
import { button, h } from '../dom'
import type { Note, RemoteSession } from '../remoteSession'

const AT_ONCE = 3
const SECONDS = 8 // that each is shown at least, unless it is closed before

export function notes(remote: RemoteSession): HTMLElement {
  const list = h('div', { class: 'list', 'aria-live': 'polite' })
  const more = button('', () => clear(), { title: 'Close them all', hidden: true })
  const shown = new Map<string, () => void>() // how each is taken away, by text
  const read = new Set<string>() // texts of errors that were shown for their time
  const waiting = new Map<string, Note>()

  const refresh = () => {
    for (const [text, note] of waiting) {
      if (shown.size >= AT_ONCE) {
        const [oldest] = read
        if (oldest === undefined) break
        shown.get(oldest)?.()
      }
      waiting.delete(text)
      show(note)
    }
    more.hidden = waiting.size === 0
    more.textContent = `${waiting.size} more, close all`
  }
  const show = ({ kind, text }: Note) => {
    const item = h('div', { class: `note ${kind}` }, h('span', {}, text))
    const timer = window.setTimeout(() => {
      if (kind !== 'error') return close()
      read.add(text)
      refresh()
    }, 1000 * SECONDS)
    const remove = () => {
      window.clearTimeout(timer)
      item.remove()
      shown.delete(text)
      read.delete(text)
    }
    const close = () => {
      remove()
      refresh()
    }
    item.append(button('×', close, { class: 'bare', 'aria-label': 'Close this note' }))
    shown.set(text, remove)
    list.append(item)
  }
  const clear = () => {
    waiting.clear()
    for (const remove of [...shown.values()]) remove()
    refresh()
  }
  remote.note.watch((note) => {
    if (!note) return
    shown.get(note.text)?.() // said again: its time starts anew
    waiting.set(note.text, note)
    refresh()
  })
  return h('div', { class: 'notes' }, list, more)
}
