// SPDX-License-Identifier: Apache-2.0
// Panel of files: exports written by the server, and the picture as seen.
import { button, h, panel } from '../dom'
import { bytes } from '../format'
import type { RemoteSession } from '../remoteSession'

const KINDS: [suffix: string, title: string][] = [
  ['.glb', 'Lit scene (.glb)'],
  ['.csv', 'Table of samples (.csv)'],
  ['.npz', 'Arrays (.npz)'],
  ['.png', 'Rendered picture (.png)'],
  ['.dlx', 'Session (.dlx)'],
]

export function filePanel(
  remote: RemoteSession,
  scene: string,
  folder: boolean,
  withToken: (address: string) => string,
  screenshot: () => void,
): HTMLElement {
  const shot = button('Screenshot', screenshot, { title: 'Saves the picture as seen here (P)' })
  if (!folder) {
    return panel(
      'Files',
      h('div', { class: 'row' }, shot),
      h('p', { class: 'quiet' }, 'Exports are off: the viewer was started without a folder for them.'),
    )
  }
  const name = h('input', { type: 'text', value: scene, 'aria-label': 'File name', spellcheck: false })
  const kind = h(
    'select',
    { 'aria-label': 'Kind of file' },
    ...KINDS.map(([suffix, title]) => h('option', { value: suffix }, title)),
  )
  const typed = () => KINDS.find(([suffix]) => name.value.trim().toLowerCase().endsWith(suffix))
  name.addEventListener('input', () => (kind.value = typed()?.[0] ?? kind.value))
  const links = h('ul', { class: 'links', 'aria-label': 'Exported files' })
  const send = button(
    'Export',
    () => void remote.edit({ type: 'export', file: name.value.trim() + (typed() ? '' : kind.value) }),
    { class: 'primary' },
  )
  remote.exported.watch((done) => {
    if (!done) return
    const link = h('a', { href: withToken(done.address), download: done.file }, done.file)
    links.prepend(h('li', {}, link, ` ${bytes(done.bytes)}`))
  })
  remote.state.watch(
    (state) => (send.disabled = !state || ['empty', 'baking', 'preview', 'checking'].includes(state.phase)),
  )
  return panel('Files', h('div', { class: 'row' }, name, kind), h('div', { class: 'row' }, send, shot), links)
}
