// SPDX-License-Identifier: Apache-2.0
// Brings settings to the screen: shader mode, exposure, ranges of the colour scales.
import { scaleFor, symmetricScale, type ColourScale } from './colourScale'
import type { ScaledMode, Settings } from './settings'
import { Signal } from './signal'
import { Creases } from './three/creases'
import type { LitScene } from './three/litScene'
import { MODES } from './three/materials'
import { measureExposure } from './three/meter'
import type { Stage } from './three/stage'

export class Look {
  readonly settings: Signal<Settings>
  metering = 0 // measurements at work
  readonly scale = new Signal<ColourScale | null>(null) // what the legend shows; null in lit pictures
  private readonly measured: Partial<Record<ScaledMode, ColourScale>> = {}
  private readonly creases: Creases
  private readonly logarithmicAsked: Partial<Record<ScaledMode, boolean>> = {}

  constructor(
    private readonly stage: Stage,
    private readonly lit: LitScene,
    settings: Settings,
    private metered: number | null,
  ) {
    this.creases = new Creases(lit.bodies)
    this.settings = new Signal(settings)
    this.settings.watch(() => this.apply())
  }

  /** Factor on radiance. */
  get exposure(): number {
    return (this.metered ?? 1) * 2 ** this.settings.value.stops
  }

  get meteredExposure(): number {
    return this.metered ?? 1
  }

  change(part: Partial<Settings>): void {
    this.settings.value = { ...this.settings.value, ...part }
  }

  changeRange(part: Partial<Settings['ranges'][ScaledMode]>): void {
    const { mode, ranges } = this.settings.value
    if (mode === 'lit') return
    const shown = this.scaleOf(mode)
    const range = {
      ...ranges[mode],
      low: shown.low,
      high: shown.high,
      logarithmic: shown.logarithmic,
      ...part,
    }
    if (mode === 'difference') range.low = -range.high
    if (range.logarithmic && !(range.low > 0)) range.low = range.high / 1000
    if (!(range.low < range.high)) return
    if (range.automatic && part.logarithmic !== undefined) this.logarithmicAsked[mode] = part.logarithmic
    delete this.measured[mode]
    this.change({ ranges: { ...ranges, [mode]: range } })
  }

  /** The light is another one: measures again what is automatic. */
  async lightChanged(): Promise<void> {
    for (const mode of Object.keys(this.measured) as ScaledMode[]) delete this.measured[mode]
    this.apply()
    if (this.settings.value.automaticExposure) await this.meter()
  }

  /** Sets the exposure by what is seen now. */
  async meter(): Promise<void> {
    if (!this.lit.values.known) return
    this.metering++
    const exposure = await measureExposure(this.stage, this.lit)
    this.metering--
    if (exposure === null) return
    this.metered = exposure
    this.apply()
  }

  private scaleOf(mode: ScaledMode): ColourScale {
    const range = this.settings.value.ranges[mode]
    if (!range.automatic) return { ...range, diverging: mode === 'difference' }
    const { values } = this.lit
    const logarithmic = this.logarithmicAsked[mode] ?? null
    this.measured[mode] ??=
      mode === 'difference'
        ? symmetricScale(values.collect((vertex) => values.change(vertex)))
        : mode === 'error'
          ? scaleFor(
              values.collect((vertex) => values.standardError(vertex)),
              logarithmic,
            )
          : scaleFor(
              values.collect((vertex) => values.photopic(vertex)),
              logarithmic,
            )
    return this.measured[mode]
  }

  private apply(): void {
    const { mode, isolines } = this.settings.value
    const { shared } = this.lit.materials
    shared.mode.value = this.lit.values.known ? MODES[mode] : MODES.clay
    shared.exposure.value = this.exposure
    shared.isolines.value = isolines
    this.creases.show(mode === 'difference')
    if (mode === 'difference' && !this.lit.values.remembered && this.lit.values.known) this.lit.remember()
    const scale = mode === 'lit' || !this.lit.values.known ? null : this.scaleOf(mode)
    if (scale) this.lit.materials.setScale(scale)
    this.scale.value = scale
    this.stage.invalidate()
  }
}
