// SPDX-License-Identifier: Apache-2.0
// States of the light that the difference view can compare with: before the last edit, the start, remembered.
import { Signal } from './signal'
import type { Snapshot, Values } from './values'

export const REFERENCES = ['edit', 'start', 'remembered'] as const
export type Reference = (typeof REFERENCES)[number]

export class References {
  /** When each was kept. */
  readonly times = new Signal<Partial<Record<Reference, Date>>>({})
  private readonly kept: Partial<Record<Reference, Snapshot>> = {}

  constructor(private readonly values: Values) {}

  /** Keeps the present light. */
  keep(reference: Reference): void {
    this.kept[reference] = this.values.snapshot()
    this.times.value = { ...this.times.value, [reference]: new Date() }
  }

  /** Another mesh is drawn: what was kept goes along, where `carry` can take it. */
  carry(carry: (kept: Snapshot) => Snapshot): void {
    for (const reference of REFERENCES) {
      const kept = this.kept[reference]
      if (kept) this.kept[reference] = carry(kept)
    }
  }

  /** What to compare with; before there was an edit, or anything remembered, that is the start. */
  of(reference: Reference): Snapshot | null {
    return this.kept[reference] ?? this.kept.start ?? null
  }
}
