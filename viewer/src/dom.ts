// SPDX-License-Identifier: Apache-2.0
// Elements in one expression, and the few controls that all panels share.

type Child = Node | string
type Attributes = Record<string, string | number | boolean | ((event: never) => void)>

/** An element; attributes that are functions listen to the event of that name. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag)
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(name, value as unknown as EventListener)
    else if (name === 'style')
      element.style.cssText = String(value) // an attribute would need a laxer security policy
    else if (typeof value === 'boolean') element.toggleAttribute(name, value)
    else element.setAttribute(name, String(value))
  }
  element.append(...children)
  return element
}

export function button(label: string, action: () => void, attributes: Attributes = {}): HTMLButtonElement {
  return h('button', { type: 'button', click: action, ...attributes }, label)
}

export function checkbox(
  label: string,
  action: (on: boolean) => void,
  attributes: Attributes = {},
): [HTMLLabelElement, HTMLInputElement] {
  const input = h('input', { type: 'checkbox', ...attributes, change: () => action(input.checked) })
  return [h('label', { class: 'check' }, input, label), input]
}

/** A number field that calls when a number was entered; Enter gives the keys back to the page. */
export function numberField(
  label: string,
  action: (value: number) => void,
  attributes: Attributes = {},
): HTMLInputElement {
  const input = h('input', {
    type: 'number',
    step: 'any',
    'aria-label': label,
    ...attributes,
    change: () => {
      if (Number.isFinite(input.valueAsNumber)) action(input.valueAsNumber)
    },
    keyup: (event: KeyboardEvent) => {
      if (event.key === 'Enter') input.blur()
    },
  })
  return input
}

/** Sets a field's text unless the user is typing into it. */
export function show(input: HTMLInputElement, value: number, digits = 3): void {
  if (document.activeElement !== input) input.value = String(Number(value.toFixed(digits)))
}

export function panel(title: string, ...children: Child[]): HTMLDetailsElement {
  return h('details', { open: true, class: 'panel' }, h('summary', {}, title), ...children)
}
