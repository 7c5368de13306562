// SPDX-License-Identifier: Apache-2.0
// Which key does what.
import { Vector3 } from 'three'
import { plain, withControl, type Shortcut } from './keys'
import type { Look } from './look'
import type { Objects } from './objects'
import type { Probes } from './probes'
import type { RemoteSession } from './remoteSession'
import { VIEW_MODES } from './settings'
import { TRANSLATION_STEP } from './three/gizmo'

const MODE_TEXTS = [
  'lit picture',
  'false colours',
  'standard error',
  'difference to before the last edit, or another state',
]

/** What keys act on: the page, as far as they know it. */
export interface KeyTarget {
  readonly objects: Objects
  readonly look: Look
  readonly remote: RemoteSession
  readonly probes: Probes
  remember(): void
  screenshot(): void
  fit(): void
  fly(): void
  showHelp(): void
}

export function shortcuts(app: KeyTarget): Shortcut[] {
  const { objects, look, remote } = app
  const nudge = (x: number, z: number) => () =>
    objects.nudge(new Vector3(x, 0, z).multiplyScalar(TRANSLATION_STEP))
  return [
    ...VIEW_MODES.map((mode, i) => plain(String(i + 1), MODE_TEXTS[i], () => look.change({ mode }))),
    plain('w', 'arrows: move the selected object', () => (objects.mode.value = 'translate')),
    plain('e', 'rings: turn it', () => (objects.mode.value = 'rotate')),
    plain('s', 'snap to 0.1 m and 15°, on or off', () =>
      look.change({ snapping: !look.settings.value.snapping }),
    ),
    plain('arrowleft', 'move it by 0.1 m along X …', nudge(-1, 0), '← →'),
    { ...plain('arrowright', '', nudge(1, 0)), keys: '' },
    plain('arrowup', '… and along Z', nudge(0, -1), '↑ ↓'),
    { ...plain('arrowdown', '', nudge(0, 1)), keys: '' },
    plain(
      'delete',
      'remove it, or put it back',
      () => {
        if (objects.selected.value !== null) objects.toggleRemoved(objects.selected.value)
      },
      'Del',
    ),
    plain('n', 'select the next movable object', () => {
      const next = objects.names.indexOf(objects.selected.value ?? '') + 1
      objects.select(objects.names[next % objects.names.length] ?? null)
    }),
    plain(
      'escape',
      'select nothing, remove pins',
      () => {
        objects.select(null)
        app.probes.clear()
      },
      'Esc',
    ),
    withControl('z', false, 'undo', () => void remote.edit({ type: 'undo' })),
    withControl('z', true, 'redo', () => void remote.edit({ type: 'redo' })),
    plain('i', 'isolines, on or off', () => look.change({ isolines: !look.settings.value.isolines })),
    plain('m', 'remember this state, and compare with it', () => app.remember()),
    plain('x', 'check exactness', () => void remote.edit({ type: 'check' })),
    plain('p', 'screenshot', () => app.screenshot()),
    plain('home', 'fit the selected object, or everything', () => app.fit(), 'Home'),
    plain('f', 'fly (W A S D, Q and E, drag to look), or back to orbit', () => app.fly()),
    plain('?', 'this list', () => app.showHelp()),
  ]
}
