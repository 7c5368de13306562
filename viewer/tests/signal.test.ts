// SPDX-License-Identifier: Apache-2.0
// Values that tell when they change.
import { expect, test } from 'vitest'
import { Signal } from '../src/signal'

test('a listener that throws keeps nothing from the others', () => {
  const signal = new Signal(1)
  const heard: number[] = []
  signal.watch((value) => {
    if (value > 1) throw new Error('one')
  })
  signal.watch((value) => {
    if (value > 2) throw new Error('two')
  })
  signal.watch((value) => heard.push(value))
  expect(() => (signal.value = 3)).toThrow('one')
  expect(heard).toEqual([1, 3])
  signal.value = 0
  expect(heard).toEqual([1, 3, 0])
})
