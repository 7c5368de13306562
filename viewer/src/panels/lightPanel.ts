// SPDX-License-Identifier: Apache-2.0
// Panel of the light groups: dimmers at work while they are moved, one for all, folded families, search, solo.
import { button, checkbox, h, panel } from '../dom'
import { families, Fader, nameInFamily, type Lights } from '../lights'

const STEPS = 1000
const BRIGHTEST = 2 // times the loaded power, at the end of the slider
const DARKEST_STOP = -8 // stops above off, on the logarithmic slider
const MANY = 6 // groups from which on they are folded and searched

/** Factor at a place 0 … 1 of the slider. */
export function factorAt(place: number, logarithmic: boolean): number {
  if (place <= 0) return 0
  const top = Math.log2(BRIGHTEST)
  return logarithmic ? 2 ** (DARKEST_STOP + place * (top - DARKEST_STOP)) : place * BRIGHTEST
}

export function placeOf(factor: number, logarithmic: boolean): number {
  if (factor <= 0) return 0
  const top = Math.log2(BRIGHTEST)
  const place = logarithmic ? (Math.log2(factor) - DARKEST_STOP) / (top - DARKEST_STOP) : factor / BRIGHTEST
  return Math.min(Math.max(place, 0), 1)
}

interface Row {
  element: HTMLElement
  refresh(): void
}

/** What one slider stands for. */
interface Dimmed {
  title: string
  text?: string // shorter than the title
  label: string
  members: string[] | null // whose light alone a button shows; null: no such button
  read: () => number
  write: (factor: number, dragging: boolean) => void
}

/** A dimmer of one light, or of several together. */
function dimmer(lights: Lights, logarithmic: () => boolean, dimmed: Dimmed): Row {
  const { title, label, members, read, write } = dimmed
  const shown = dimmed.text ?? title
  const text = h('output', {})
  let held = false
  const send = (dragging: boolean) => () => {
    held = dragging
    write(factorAt(Number(slider.value) / STEPS, logarithmic()), dragging)
  }
  const slider = h('input', {
    type: 'range',
    min: 0,
    max: STEPS,
    'aria-label': label,
    input: send(true),
    change: send(false),
  })
  const reset = button('Reset', () => write(1, false), {
    class: 'bare',
    'aria-label': `Reset ${label}`,
    title: 'As loaded',
  })
  const solo = button('Solo', () => lights.solo(members ?? []), {
    class: 'bare',
    'aria-label': `Solo ${title}`,
    title: 'Switch all others off, or back on',
    hidden: members === null || members.length === lights.names.length,
  })
  const refresh = () => {
    const factor = read()
    const alone = lights.alone.value
    const pressed = members?.length === alone.size && members.every((name) => alone.has(name))
    solo.setAttribute('aria-pressed', String(pressed))
    if (!held) slider.value = String(Math.round(STEPS * placeOf(factor, logarithmic())))
    text.textContent = percent(factor)
    slider.setAttribute('aria-valuetext', percent(factor))
  }
  return {
    element: h('div', { class: 'dimmer' }, h('span', { title }, shown), text, solo, reset, slider),
    refresh,
  }
}

interface Found {
  name: string
  element: HTMLElement
}

/** Hides the lights whose names do not hold what is typed, and opens the families of those that do. */
function searchField(found: Found[], folds: HTMLDetailsElement[]): HTMLInputElement {
  const search = h('input', {
    type: 'search',
    placeholder: `Search ${found.length} lights`,
    'aria-label': 'Search lights',
    input: () => {
      const wanted = search.value.trim().toLowerCase()
      for (const { name, element } of found) element.hidden = !name.toLowerCase().includes(wanted)
      for (const fold of folds) {
        const any = [...fold.querySelectorAll<HTMLElement>('.dimmer')].some((row) => !row.hidden)
        fold.parentElement!.hidden = !any
        fold.open = wanted !== '' && any
      }
    },
  })
  return search
}

/** What the panel shows for the groups that there are, and all its dimmers. */
function dimmers(lights: Lights, logarithmic: () => boolean): { rows: Row[]; elements: HTMLElement[] } {
  const rows: Row[] = []
  const found: Found[] = []
  const folds: HTMLDetailsElement[] = []
  const many = lights.names.length > MANY

  const add = (dimmed: Dimmed) => {
    const row = dimmer(lights, logarithmic, dimmed)
    rows.push(row)
    return row.element
  }
  const together = (title: string, label: string, members: string[], solo: boolean) => {
    const fader = new Fader(members, lights.factors)
    return add({
      title,
      label,
      members: solo ? members : null,
      read: () => fader.level,
      write: (level, dragging) => lights.set(fader.at(level), dragging),
    })
  }
  const single = (name: string, text = name) => {
    const element = add({
      title: name,
      text,
      label: `Light of ${name}`,
      members: [name],
      read: () => lights.factors.get(name) ?? 1,
      write: (factor, dragging) => lights.set({ [name]: factor }, dragging),
    })
    found.push({ name, element })
    return element
  }
  const family = ([title, members]: [string, string[]]) => {
    if (members.length === 1) return single(members[0])
    const whole = together(title, `Lights of ${title}`, members, true)
    const summary = h('summary', {}, `${title}: ${members.length} lights`)
    const fold = h(
      'details',
      { class: 'family' },
      summary,
      ...members.map((name) => single(name, nameInFamily(name))),
    )
    folds.push(fold)
    return h('div', { class: 'fold' }, whole, fold)
  }
  const all = many ? [...families(lights.names)].map(family) : lights.names.map((name) => single(name))
  const search = searchField(found, folds)
  search.hidden = !many
  const master = together('All lights', 'All lights', lights.names, false)
  master.hidden = lights.names.length < 2
  return { rows, elements: [master, search, ...all] }
}

export function lightPanel(lights: Lights): HTMLElement {
  let logarithmic = false
  let { rows, elements } = dimmers(lights, () => logarithmic)
  const refresh = () => {
    for (const row of rows) row.refresh()
  }
  const [log] = checkbox('Sliders by stops', (on) => {
    logarithmic = on
    refresh()
  })
  const element = panel('Lights', log)
  lights.groups.watch(() => {
    for (const each of elements) each.remove()
    ;({ rows, elements } = dimmers(lights, () => logarithmic))
    log.before(...elements)
    refresh()
  })
  lights.changed.watch(refresh)
  lights.alone.watch(refresh)
  return element
}

const percent = (factor: number) => `${Number((100 * factor).toFixed(factor < 0.1 ? 1 : 0))} %`
