// SPDX-License-Identifier: Apache-2.0
// Brings settings to the screen: shader mode, exposure, ranges of the colour scales.
import { scaleFor, symmetricScale, type ColourScale } from './colourScale'
import type { References } from './references'
import type { ScaledMode, Settings } from './settings'
import { Signal } from './signal'
import { Creases } from './three/creases'
import type { LitScene } from './three/litScene'
import { MODES } from './three/materials'
import { measureExposure, seenValues } from './three/meter'
import type { Stage } from './three/stage'

export class Look {
  readonly settings: Signal<Settings>
  metering = 0 // measurements at work
  dark = false // the last measurement found no light to go by
  readonly scale = new Signal<ColourScale | null>(null) // what the legend shows; null in lit pictures
  private readonly measured: Partial<Record<ScaledMode, ColourScale>> = {}
  private readonly creases: Creases
  private readonly logarithmicAsked: Partial<Record<ScaledMode, boolean>> = {}

  constructor(
    private readonly stage: Stage,
    private readonly lit: LitScene,
    private readonly references: References,
    settings: Settings,
    private metered: number | null,
  ) {
    this.creases = new Creases(lit)
    this.settings = new Signal(settings)
    this.settings.watch(() => this.apply())
    this.references.times.watch(() => this.apply())
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

  /** The mesh that is drawn is another one. */
  remeshed(): void {
    this.creases.renew()
    this.apply()
  }

  /** The light, or the view, is another one: measures again what is automatic. */
  async measureAgain(): Promise<void> {
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
    this.dark = exposure === null
    if (exposure === null) return
    this.metered = exposure
    this.apply()
  }

  private scaleOf(mode: ScaledMode): ColourScale {
    const range = this.settings.value.ranges[mode]
    if (!range.automatic) return { ...range, diverging: mode === 'difference' }
    return (this.measured[mode] ??= this.measuredScale(mode))
  }

  /** The scale that suits what is seen now. */
  private measuredScale(mode: ScaledMode): ColourScale {
    const seen = seenValues(this.stage, this.lit, mode)
    if (mode === 'difference') return symmetricScale(seen)
    if (mode === 'falseColour') this.dark = !seen.some((value) => value > 0)
    return scaleFor(seen, this.logarithmicAsked[mode] ?? null)
  }

  private apply(): void {
    const { mode, isolines, reference, textures } = this.settings.value
    const { values } = this.lit
    const { shared } = this.lit.materials
    const lightless = this.lit.info.groups.length === 0 // all would be black
    shared.mode.value = values.known && !(lightless && mode === 'lit') ? MODES[mode] : MODES.clay
    shared.exposure.value = this.exposure
    shared.isolines.value = isolines
    shared.textures.value = textures
    this.creases.show(mode === 'difference')
    const compared =
      mode === 'difference' || reference === 'remembered' ? this.references.of(reference) : null
    if (values.reference !== compared) delete this.measured.difference
    values.reference = compared
    if (mode === 'difference') this.lit.uploadReference()
    const scale = mode === 'lit' || !values.known ? null : this.scaleOf(mode)
    if (scale) this.lit.materials.setScale(scale)
    this.scale.value = scale
    this.stage.invalidate()
  }
}
