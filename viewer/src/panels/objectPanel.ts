// SPDX-License-Identifier: Apache-2.0
// Panel of the movable objects: choice, place in numbers, remove and add.
import { button, checkbox, h, numberField, panel, show } from '../dom'
import type { Look } from '../look'
import type { Objects } from '../objects'
import type { RemoteSession } from '../remoteSession'
import type { GizmoMode, Placement } from '../three/gizmo'

const AXES = ['X', 'Y', 'Z'] as const

// long: a list of controls, each of a few lines.
export function objectPanel(objects: Objects, remote: RemoteSession, look: Look): HTMLElement {
  const list = h('select', {
    'aria-label': 'Movable object',
    change: () => objects.select(list.value || null),
  })
  list.append(h('option', { value: '' }, objects.names.length ? 'nothing selected' : 'nothing is movable'))
  for (const name of objects.names) list.append(h('option', { value: name }, name))

  const removal = button('Remove', () => {
    if (objects.selected.value !== null) objects.toggleRemoved(objects.selected.value)
  })
  const change = (part: keyof Placement, axis: number, value: number) => {
    const placement = objects.gizmo.placement()
    placement[part][axis] = value
    objects.place(placement)
  }
  const row = (part: keyof Placement, title: string, unit: string, step: number) => {
    const fields = AXES.map((axis, i) =>
      numberField(`${title} ${axis}, ${unit}`, (value) => change(part, i, value), {
        step: String(step),
        'data-axis': axis,
      }),
    )
    return { fields, element: h('div', { class: 'axes' }, h('span', {}, `${title}, ${unit}`), ...fields) }
  }
  const position = row('position', 'Position', 'm', 0.05)
  const turn = row('degrees', 'Rotation', '°', 5)

  const modes: Record<GizmoMode, HTMLButtonElement> = {
    translate: button('Move', () => (objects.mode.value = 'translate'), { title: 'Arrows (W)' }),
    rotate: button('Rotate', () => (objects.mode.value = 'rotate'), { title: 'Rings (E)' }),
  }
  objects.mode.watch((mode) => {
    for (const [name, element] of Object.entries(modes))
      element.setAttribute('aria-pressed', String(name === mode))
  })
  const [snap, snapInput] = checkbox('Snap to 0.1 m and 15°', (on) => look.change({ snapping: on }))
  look.settings.watch(({ snapping }) => {
    snapInput.checked = snapping
    objects.gizmo.setSnapping(snapping)
  })

  const details = h(
    'div',
    { class: 'stack' },
    h(
      'div',
      { class: 'row' },
      h(
        'div',
        { class: 'segments', role: 'group', 'aria-label': 'What dragging does' },
        modes.translate,
        modes.rotate,
      ),
      removal,
    ),
    position.element,
    turn.element,
    snap,
  )
  const refresh = () => {
    const name = objects.selected.value
    list.value = name ?? ''
    details.hidden = name === null
    const removed = name !== null && objects.isRemoved(name)
    removal.textContent = removed ? 'Put back' : 'Remove'
    for (const field of [...position.fields, ...turn.fields]) field.disabled = removed
  }
  objects.selected.watch(refresh)
  remote.state.watch(refresh)
  objects.placement.watch((placement) => {
    if (!placement) return
    position.fields.forEach((field, i) => show(field, placement.position[i]))
    turn.fields.forEach((field, i) => show(field, placement.degrees[i], 1))
  })
  return panel('Object', list, details)
}
