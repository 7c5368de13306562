// SPDX-License-Identifier: Apache-2.0
// What the server last said of every vertex, as halves, and an earlier state of it to compare with.
import { DataUtils } from 'three'
import type { Run, ValuesFrame } from './protocol'

export const CHANNELS = 4 // R, G, B irradiance, photopic standard error
export const UNKNOWN = [0, 0, 0, 0xbc00] // halves of a vertex that has no value: its error is −1
const PHOTOPIC = [0.2126, 0.7152, 0.0722]

/** The values of one moment. */
export interface Snapshot {
  halves: Uint16Array
  scale: number
}

/** Whether a state has no value for a vertex. */
export function isUnknown(halves: Uint16Array, vertex: number): boolean {
  return halves[CHANNELS * vertex + 3] === UNKNOWN[3]
}

/** Values of all vertices; what the halves hold is the value × scale. */
export class Values {
  halves: Uint16Array
  scale = 1
  known = false // a frame has arrived
  preview = false
  reference: Snapshot | null = null // what changes are counted from

  constructor(public vertices: number) {
    this.halves = new Uint16Array(CHANNELS * vertices)
  }

  /** From now on those of another mesh, which a full frame brings. */
  resize(vertices: number): void {
    this.vertices = vertices
    this.halves = new Uint16Array(CHANNELS * vertices)
  }

  /** Takes a frame over; returns the runs that changed. */
  apply(frame: ValuesFrame): Run[] {
    if (frame.scale !== this.scale && !frame.full) {
      throw new Error('frame: the scale changed in a frame that is not of all vertices')
    }
    this.scale = frame.scale
    this.preview = frame.preview
    this.known = true
    let start = 0
    for (const run of frame.runs) {
      if (run.first + run.count > this.vertices) {
        throw new Error(`frame: found a run to vertex ${run.first + run.count} of ${this.vertices}`)
      }
      const end = start + CHANNELS * run.count
      this.halves.set(frame.halves.subarray(start, end), CHANNELS * run.first)
      start = end
    }
    return frame.runs
  }

  /** The present values, which later frames leave alone. */
  snapshot(): Snapshot {
    return { halves: this.halves.slice(), scale: this.scale }
  }

  /** Irradiance of one vertex, R, G, B. */
  rgb(vertex: number): number[] {
    return [0, 1, 2].map((channel) => this.read(this.halves, this.scale, vertex, channel))
  }

  photopic(vertex: number): number {
    return photopic(this.rgb(vertex))
  }

  standardError(vertex: number): number {
    return this.read(this.halves, this.scale, vertex, 3)
  }

  /** Photopic value now minus that of the reference, null without; exactly zero where the bits are equal. */
  change(vertex: number): number | null {
    const before = this.reference
    if (!before || isUnknown(before.halves, vertex)) return null
    return photopic(this.rgb(vertex).map((now, c) => now - this.read(before.halves, before.scale, vertex, c)))
  }

  private read(halves: Uint16Array, scale: number, vertex: number, channel: number): number {
    return DataUtils.fromHalfFloat(halves[CHANNELS * vertex + channel]) / scale
  }
}

const photopic = (rgb: number[]): number => PHOTOPIC[0] * rgb[0] + PHOTOPIC[1] * rgb[1] + PHOTOPIC[2] * rgb[2]
