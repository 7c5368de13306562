// SPDX-License-Identifier: Apache-2.0
// A record of moves that can be played back and scrubbed; every step goes through the server like a drag.
import { Matrix4, Quaternion, Vector3 } from 'three'
import type { Objects } from './objects'
import { Signal } from './signal'

const PAUSE = 0.25 // seconds between two drags on the record, however long the user waited

interface Key {
  seconds: number
  pose: Matrix4
}

export class Timeline {
  readonly recording = new Signal(false)
  readonly playing = new Signal(false)
  readonly seconds = new Signal(0)
  readonly duration = new Signal(0)
  private readonly tracks = new Map<string, Key[]>()
  private dragStart: number | null = null // clock and record when the drag at work began
  private recordStart = 0
  private replaying = false // what is moved now comes from the record

  constructor(private readonly objects: Objects) {
    objects.moved.push((name, pose, dragging) => this.record(name, pose, dragging))
  }

  clear(): void {
    this.stop()
    this.tracks.clear()
    this.duration.value = 0
    this.seconds.value = 0
  }

  play(): void {
    if (this.duration.value === 0) return
    this.recording.value = false
    this.playing.value = true
    const from = this.seconds.value < this.duration.value ? this.seconds.value : 0
    const start = performance.now()
    const step = () => {
      if (!this.playing.value) return
      const at = Math.min(from + (performance.now() - start) / 1000, this.duration.value)
      const last = at >= this.duration.value
      this.show(at, !last)
      if (last) this.playing.value = false
      else requestAnimationFrame(step)
    }
    requestAnimationFrame(step)
  }

  stop(): void {
    if (!this.playing.value) return
    this.playing.value = false
    this.show(this.seconds.value, false)
  }

  /** Puts all recorded objects where they were at a time; `dragging`: others will follow. */
  show(seconds: number, dragging: boolean): void {
    this.seconds.value = seconds
    this.replaying = true
    for (const [name, keys] of this.tracks) {
      if (!this.objects.isRemoved(name)) this.objects.moveTo(name, poseAt(keys, seconds), dragging)
    }
    this.replaying = false
  }

  private record(name: string, pose: Matrix4, dragging: boolean): void {
    if (!this.recording.value || this.replaying) return
    const now = performance.now() / 1000
    if (this.dragStart === null) {
      this.dragStart = now
      this.recordStart = this.duration.value === 0 ? 0 : this.duration.value + PAUSE
    }
    const at = this.recordStart + now - this.dragStart
    const keys = this.tracks.get(name) ?? []
    const last = keys.at(-1)
    if (last && last.seconds < this.recordStart) keys.push({ seconds: this.recordStart, pose: last.pose })
    keys.push({ seconds: at, pose: pose.clone() })
    this.tracks.set(name, keys)
    this.duration.value = Math.max(at, 0.01)
    this.seconds.value = at
    if (!dragging) this.dragStart = null
  }
}

/** Pose between two keys: straight way, shortest turn. */
export function poseAt(keys: { seconds: number; pose: Matrix4 }[], seconds: number): Matrix4 {
  const next = keys.findIndex((key) => key.seconds > seconds)
  if (next === 0) return keys[0].pose.clone()
  if (next < 0) return keys[keys.length - 1].pose.clone()
  const [before, after] = [keys[next - 1], keys[next]]
  const share = (seconds - before.seconds) / (after.seconds - before.seconds)
  const [a, b] = [before, after].map(({ pose }) => {
    const [position, turn] = [new Vector3(), new Quaternion()]
    pose.decompose(position, turn, new Vector3())
    return { position, turn }
  })
  return new Matrix4().compose(
    a.position.lerp(b.position, share),
    a.turn.slerp(b.turn, share),
    new Vector3(1, 1, 1),
  )
}
