// SPDX-License-Identifier: Apache-2.0
// Bar at the top: what is shown, from where, undo and redo, help.
import { button, h } from '../dom'
import type { Look } from '../look'
import type { SceneInfo } from '../protocol'
import type { RemoteSession } from '../remoteSession'
import { VIEW_MODES, type ViewMode } from '../settings'

const MODE_NAMES: Record<ViewMode, [name: string, key: string]> = {
  lit: ['Lit', '1'],
  falseColour: ['False colour', '2'],
  error: ['Standard error', '3'],
  difference: ['Difference', '4'],
}
const PHASES: Record<string, string> = {
  empty: 'No light yet',
  baking: 'Baking',
  preview: 'Preview',
  ready: 'Exact',
  updating: 'Updating',
  checking: 'Checking',
  failed: 'Update failed',
}

export interface HeaderActions {
  showCamera(index: number): void
  fit(): void
  fly(): void
  help(): void
  drawer(open: boolean): void
}

export function header(
  info: SceneInfo,
  look: Look,
  remote: RemoteSession,
  actions: HeaderActions,
): { element: HTMLElement; fly: HTMLButtonElement } {
  const phase = h('span', { class: 'phase', role: 'status', 'aria-label': 'State of the light' })
  const undo = button('Undo', () => void remote.edit({ type: 'undo' }))
  const redo = button('Redo', () => void remote.edit({ type: 'redo' }))
  const showPhase = () => {
    const state = remote.state.value
    // What was exact when the server went may be so no longer, and nothing can be asked of it.
    const away = remote.link.value === 'lost'
    phase.textContent = away ? 'Server away' : state ? PHASES[state.phase] : 'Connecting'
    phase.dataset.phase = away ? 'failed' : (state?.phase ?? 'empty')
  }
  remote.link.watch(showPhase)
  remote.state.watch((state) => {
    showPhase()
    undo.disabled = !state?.undo
    redo.disabled = !state?.redo
    undo.title = state?.undo ? `Undo: ${state.undo} (Ctrl+Z)` : 'Nothing to undo'
    redo.title = state?.redo ? `Redo: ${state.redo} (Ctrl+Shift+Z)` : 'Nothing to redo'
  })

  const modes = VIEW_MODES.map((mode) => {
    const [name, key] = MODE_NAMES[mode]
    return button(name, () => look.change({ mode }), { title: `${name} (${key})`, 'data-mode': mode })
  })
  look.settings.watch(({ mode }) => {
    for (const element of modes) element.setAttribute('aria-pressed', String(element.dataset.mode === mode))
  })

  const cameras = h(
    'select',
    {
      'aria-label': 'Camera',
      change: () => {
        actions.showCamera(Number(cameras.value))
        cameras.selectedIndex = 0
      },
    },
    h('option', { value: '', disabled: true, selected: true }, 'Camera'),
    ...info.cameras.map((camera, i) => h('option', { value: i }, camera.name)),
  )
  const fly = button('Fly', actions.fly, { title: 'Fly with W A S D, Q, E (F)', 'aria-pressed': 'false' })
  const drawer = button(
    'Panels',
    () => {
      const open = drawer.getAttribute('aria-expanded') !== 'true'
      drawer.setAttribute('aria-expanded', String(open))
      actions.drawer(open)
    },
    { class: 'drawer', 'aria-controls': 'panels', 'aria-expanded': 'false' },
  )
  const element = h(
    'header',
    {},
    h('h1', {}, h('b', {}, 'Deltalux'), h('span', {}, info.name)),
    phase,
    h('div', { class: 'segments', role: 'group', 'aria-label': 'What is shown' }, ...modes),
    h(
      'div',
      { class: 'row camera', role: 'group', 'aria-label': 'Camera' },
      cameras,
      button('Fit', actions.fit, { title: 'Everything, or the selected object (Home)' }),
      fly,
    ),
    h('div', { class: 'row history', role: 'group', 'aria-label': 'History' }, undo, redo),
    button('?', actions.help, { 'aria-label': 'Keys', title: 'Keys (?)', class: 'round' }),
    drawer,
  )
  return { element, fly }
}
