// SPDX-License-Identifier: Apache-2.0
// Light groups as the user handles them: one by one, by families of names, all together, or one alone.
import type { RemoteSession } from './remoteSession'
import { Signal } from './signal'

export type Factors = Record<string, number>

/** Part of a name that related lamps share: what stands before a separator, else before a number at the end. */
export function familyOf(name: string): string {
  const separated = /^(.+?)\s*[/:|]/.exec(name)
  if (separated) return separated[1]
  return name.replace(/[\s._-]*\d+$/, '') || name
}

/** What a lamp is called among those of its family: what stands after a separator, else its name. */
export function nameInFamily(name: string): string {
  return /^.+?\s*[/:|]\s*(.+)$/.exec(name)?.[1] ?? name
}

/** Names by family, in the order of the names; a family of one has no others to be folded with. */
export function families(names: string[]): Map<string, string[]> {
  const found = new Map<string, string[]>()
  for (const name of names) {
    const family = familyOf(name)
    found.set(family, [...(found.get(family) ?? []), name])
  }
  return found
}

/** Several groups on one dimmer, which keeps their proportions, also through zero. */
export class Fader {
  level = 1
  private readonly full = new Map<string, number>() // factors at level 1

  constructor(
    readonly members: string[],
    private readonly factors: ReadonlyMap<string, number>,
  ) {}

  /** The members' factors at a level. */
  at(level: number): Factors {
    for (const name of this.members) {
      const now = this.factors.get(name) ?? 1
      if (this.level > 0) this.full.set(name, now / this.level)
      else if (now > 0) this.full.set(name, now) // was switched on by itself meanwhile
    }
    this.level = level
    return Object.fromEntries(this.members.map((name) => [name, level * (this.full.get(name) ?? 1)]))
  }
}

export class Lights {
  readonly factors = new Map<string, number>()
  readonly changed = new Signal<null>(null)
  /** Names of those that shine alone. */
  readonly alone = new Signal<ReadonlySet<string>>(new Set())
  private held = new Set<string>() // groups that the user is dimming, ahead of the server's state
  private before: Factors | null = null // factors before some shone alone

  /** Names of the groups, which another version of the scene changes. */
  readonly groups: Signal<string[]>

  constructor(
    names: string[],
    private readonly remote: RemoteSession,
  ) {
    this.groups = new Signal(names)
    for (const name of names) this.factors.set(name, 1)
    remote.state.watch((state) => {
      for (const [name, factor] of Object.entries(state?.factors ?? {})) {
        if (!this.held.has(name)) this.factors.set(name, factor)
      }
      this.changed.value = null
    })
  }

  get names(): string[] {
    return this.groups.value
  }

  rename(names: string[]): void {
    for (const name of names) if (!this.factors.has(name)) this.factors.set(name, 1)
    this.groups.value = names
  }

  /** Sets groups; `dragging`: others will follow. */
  set(factors: Factors, dragging = false): void {
    const rounded = Object.entries(factors).map(
      ([name, factor]) => [name, Number(factor.toPrecision(4))] as const,
    )
    for (const [name, factor] of rounded) {
      this.factors.set(name, factor)
      if (dragging) this.held.add(name)
      else this.held.delete(name)
    }
    this.changed.value = null
    if (rounded.length === 0) return
    const [[group, factor]] = rounded
    void this.remote.drag(
      rounded.length === 1
        ? { type: 'dim', group, factor, dragging }
        : { type: 'dims', factors: Object.fromEntries(rounded), dragging },
    )
  }

  /** Lets some shine alone; asked again, brings the others back. */
  solo(names: string[]): void {
    const again = names.length === this.alone.value.size && names.every((name) => this.alone.value.has(name))
    const before = this.before ?? Object.fromEntries(this.factors)
    this.before = again ? null : before
    this.alone.value = new Set(again ? [] : names)
    const wanted = (name: string) => (again || this.alone.value.has(name) ? (before[name] ?? 1) : 0)
    this.set(
      Object.fromEntries(
        this.names
          .map((name) => [name, wanted(name)])
          .filter(([name, v]) => this.factors.get(name as string) !== v),
      ) as Factors,
    )
  }
}
