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

  /** Tells the value again: something that it stands for is another. */
  tell(): void {
    for (const listener of this.listeners) listener(this.current)
  }

  /** Calls at each change, and once now. */
  watch(listener: (value: T) => void): void {
    this.listeners.push(listener)
    listener(this.current)
  }
}
