// SPDX-License-Identifier: Apache-2.0
// A value that tells those who asked when it changes.

export class Signal<T> {
  private readonly listeners: ((value: T) => void)[] = []

  constructor(private current: T) {}

  get value(): T {
    return this.current
  }

  set value(value: T) {
    this.current = value
    this.tell()
  }

  /** Tells the value again: something that it stands for is another. All are told, even if one of them throws. */
  tell(): void {
    const errors: unknown[] = []
    for (const listener of this.listeners) {
      try {
        listener(this.current)
      } catch (error) {
        errors.push(error)
      }
    }
    if (errors.length) throw errors[0]
  }

  /** Calls at each change, and once now. */
  watch(listener: (value: T) => void): void {
    this.listeners.push(listener)
    listener(this.current)
  }
}
