// SPDX-License-Identifier: Apache-2.0
// The server refines the drawn mesh where shadows lie: fetches the new one, and holds its values until it is here.
import type { SceneInfo, ValuesFrame } from './protocol'

const PAUSE = 1000 // ms before a geometry that did not come is asked for again

/** The parts of a scene that the page loads. */
export interface Loaded {
  info: SceneInfo
  buffer: ArrayBuffer
}

/** A geometry of another number has taken the place of the one that was asked for. */
export class Gone extends Error {}

export class Remeshing {
  private wanted: number | null = null // geometry that is being loaded, or waits for its values
  private loaded: Loaded | null = null
  private readonly waiting: ValuesFrame[] = []

  /**
   * `load`: fetches a geometry; `swap`: draws it from now on; `apply`: takes its values;
   * `dropped`: values that will never be shown.
   */
  constructor(
    private readonly load: (number: number) => Promise<Loaded>,
    private readonly swap: (loaded: Loaded) => void,
    private readonly apply: (frame: ValuesFrame, remeshed: boolean) => void,
    private readonly dropped: (frame: ValuesFrame) => void,
  ) {}

  /** Values from now on are those of the geometry `number`; `shown` is the one that is drawn. */
  announce(number: number, shown: number): void {
    this.forget()
    if (number === shown) return
    this.wanted = number
    void this.fetch(number)
  }

  take(frame: ValuesFrame): void {
    if (this.wanted === null) {
      this.apply(frame, false)
      return
    }
    this.waiting.push(frame)
    this.goOn()
  }

  /** The connection is a new one: what was on the way is lost. */
  startOver(): void {
    this.waiting.length = 0
    this.forget()
  }

  private async fetch(number: number): Promise<void> {
    while (this.wanted === number && !this.loaded) {
      try {
        const loaded = await this.load(number)
        if (this.wanted === number) this.loaded = loaded
      } catch (error) {
        if (error instanceof Gone) return // the message about the one after it is on its way
        await new Promise((resolve) => setTimeout(resolve, PAUSE))
      }
    }
    this.goOn()
  }

  /** Draws the new mesh once its values are here, too: else it would be dark for a moment. */
  private goOn(): void {
    if (!this.loaded || this.waiting.length === 0) return
    const [loaded, frames] = [this.loaded, [...this.waiting]]
    this.waiting.length = 0
    this.forget()
    this.swap(loaded)
    frames.forEach((frame, i) => this.apply(frame, i === 0))
  }

  private forget(): void {
    for (const frame of this.waiting.splice(0)) this.dropped(frame)
    this.wanted = this.loaded = null
  }
}
