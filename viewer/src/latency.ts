// SPDX-License-Identifier: Apache-2.0
// Times from a pose sent to the first frame that holds its light, uploaded and drawn.
import { Signal } from './signal'

const KEPT = 10_000 // latencies

export class Latency {
  readonly last = new Signal<number | null>(null)
  readonly all: number[] = []
  private waiting: { sent: number; revision: number }[] = []

  /** An edit that was sent at a time (`performance.now()`) is part of this revision. */
  accepted(sent: number, revision: number): void {
    this.waiting.push({ sent, revision })
  }

  /** A frame's values of that revision are on the screen. */
  shown(revision: number): void {
    const done = this.waiting.filter((edit) => edit.revision <= revision)
    if (done.length === 0) return
    const now = performance.now()
    for (const { sent } of done) this.all.push(now - sent)
    if (this.all.length > KEPT) this.all.splice(0, this.all.length - KEPT)
    this.waiting = this.waiting.filter((edit) => edit.revision > revision)
    this.last.value = this.all[this.all.length - 1]
  }

  /** After a lost connection nothing is on its way. */
  forget(): void {
    this.waiting = []
  }
}
