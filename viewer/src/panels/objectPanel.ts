// SPDX-License-Identifier: Apache-2.0
// Panel of the selected object: choice, place in numbers, remove and add, or how it becomes movable.
import { button, checkbox, h, numberField, panel, show } from '../dom'
import type { Look } from '../look'
import type { Objects } from '../objects'
import type { RemoteSession } from '../remoteSession'
import type { GizmoMode, Placement } from '../three/gizmo'

const AXES = ['X', 'Y', 'Z'] as const

// long: a list of controls, each of a few lines.
export function objectPanel(objects: Objects, remote: RemoteSession, look: Look): HTMLElement {
  const list = h('select', {
    'aria-label': 'Selected object',
    change: () => objects.select(list.value || null),
  })
  let listed = ''
  const fill = () => {
    const { names, selected } = objects
    const key = JSON.stringify([names, selected.value])
    if (key === listed) return // a list that is open stays as it is
    listed = key
    const none = names.length ? 'nothing selected' : 'nothing is movable'
    const fixed = selected.value === null || names.includes(selected.value) ? [] : [selected.value]
    const options = names.map((name) => h('option', { value: name }, name))
    list.replaceChildren(
      h('option', { value: '' }, none),
      ...options,
      ...fixed.map((name) => h('option', { value: name }, `${name} (fixed)`)),
    )
  }
  const makeMovable = button(
    'Make movable',
    () => {
      if (objects.selected.value !== null) objects.makeMovable(objects.selected.value)
    },
    { class: 'primary' },
  )
  const fixed = h(
    'div',
    { class: 'stack' },
    h('span', { class: 'quiet' }, 'It cannot be moved yet: that takes another bake, which keeps all edits.'),
    h('div', { class: 'row' }, makeMovable),
  )

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
    fill()
    list.value = name ?? ''
    const movable = name !== null && objects.isMovable(name)
    details.hidden = !movable
    fixed.hidden = name === null || movable
    const phase = remote.state.value?.phase
    makeMovable.disabled = phase === 'baking' || phase === 'preview' || phase === 'checking'
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
  return panel('Object', list, fixed, details)
}
