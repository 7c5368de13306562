// SPDX-License-Identifier: Apache-2.0
// Times from a pose sent to the first frame that holds its light, uploaded and drawn.
import type { Edit, Pose, StateMessage } from './protocol'
import { Signal } from './signal'

interface Sent {
  name: string
  pose: Pose
  at: number
  revision: number | null // as soon as a state shows the pose
}

const KEPT = 10_000 // latencies

export class Latency {
  readonly last = new Signal<number | null>(null)
  readonly all: number[] = []
  private sent: Sent[] = []

  edit(edit: Edit): void {
    if (edit.type === 'move')
      this.sent.push({ name: edit.name, pose: edit.pose, at: performance.now(), revision: null })
  }

  /** The server's state shows which of the poses has become which revision; older ones were overtaken. */
  state(state: StateMessage): void {
    for (const sent of this.sent) {
      if (sent.revision === null && samePose(sent.pose, state.poses[sent.name]))
        sent.revision = state.revision
    }
    const newest = this.sent.findLastIndex((sent) => sent.revision !== null)
    this.sent = this.sent.filter((sent, i) => i >= newest || sent.revision !== null)
  }

  /** A frame's values of that revision are on the screen. */
  shown(revision: number): void {
    const done = this.sent.filter((sent) => sent.revision !== null && sent.revision <= revision)
    if (done.length === 0) return
    const now = performance.now()
    for (const { at } of done) this.all.push(now - at)
    if (this.all.length > KEPT) this.all.splice(0, this.all.length - KEPT)
    this.sent = this.sent.filter((sent) => !done.includes(sent))
    this.last.value = this.all[this.all.length - 1]
  }

  /** After a lost connection nothing is on its way. */
  forget(): void {
    this.sent = []
  }
}

function samePose(a: Pose, b: Pose | null | undefined): boolean {
  return !!b && a.every((value, i) => value === b[i])
}
