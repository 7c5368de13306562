// SPDX-License-Identifier: Apache-2.0
// How the scene is looked at; kept in the address, so that a link brings the view back.
import type { Pose } from './protocol'
import { REFERENCES, type Reference } from './references'

export const VIEW_MODES = ['lit', 'falseColour', 'error', 'difference'] as const
export type ViewMode = (typeof VIEW_MODES)[number]
export type ScaledMode = Exclude<ViewMode, 'lit'>

export interface RangeSetting {
  automatic: boolean
  low: number
  high: number
  logarithmic: boolean
}

export interface Settings {
  mode: ViewMode
  automaticExposure: boolean
  stops: number // brighter than the meter says, powers of two
  isolines: boolean
  textures: boolean // in lit pictures
  snapping: boolean
  reference: Reference // of the difference view
  ranges: Record<ScaledMode, RangeSetting>
}

export interface Eye {
  pose: Pose
  target: [number, number, number]
  verticalFov: number // degrees
}

const NO_RANGE: RangeSetting = { automatic: true, low: 0, high: 1, logarithmic: false }

export const defaultSettings = (): Settings => ({
  mode: 'lit',
  automaticExposure: true,
  stops: 0,
  isolines: false,
  textures: true,
  snapping: false,
  reference: 'edit',
  ranges: { falseColour: { ...NO_RANGE }, error: { ...NO_RANGE }, difference: { ...NO_RANGE } },
})

/** Short text for the address. Ranges only where they were set by hand. */
export function toHash(settings: Settings, exposure: number, eye: Eye): string {
  const fields = new URLSearchParams({ mode: settings.mode })
  if (!settings.automaticExposure) fields.set('exposure', exposure.toPrecision(5))
  if (settings.stops !== 0) fields.set('stops', String(settings.stops))
  if (settings.isolines) fields.set('isolines', '1')
  if (!settings.textures) fields.set('textures', '0')
  if (settings.snapping) fields.set('snap', '1')
  if (settings.reference !== 'edit') fields.set('reference', settings.reference)
  for (const [mode, range] of Object.entries(settings.ranges)) {
    if (!range.automatic) fields.set(mode, [range.low, range.high, Number(range.logarithmic)].join(','))
  }
  fields.set('eye', [...eye.pose, ...eye.target, eye.verticalFov].map((v) => Number(v.toFixed(4))).join(','))
  return `#${fields.toString().replaceAll('%2C', ',')}`
}

/** What an address asks for; anything unreadable is left out. */
export function fromHash(hash: string): { settings: Settings; exposure: number | null; eye: Eye | null } {
  const fields = new URLSearchParams(hash.replace(/^#/, ''))
  const settings = defaultSettings()
  const mode = fields.get('mode') as ViewMode
  if (VIEW_MODES.includes(mode)) settings.mode = mode
  const exposure = positive(fields.get('exposure'))
  settings.automaticExposure = exposure === null
  settings.stops = numbers(fields.get('stops'), 1)?.[0] ?? 0
  settings.isolines = fields.get('isolines') === '1'
  settings.textures = fields.get('textures') !== '0'
  settings.snapping = fields.get('snap') === '1'
  const reference = fields.get('reference') as Reference
  if (REFERENCES.includes(reference)) settings.reference = reference
  for (const name of Object.keys(settings.ranges) as ScaledMode[]) {
    const range = numbers(fields.get(name), 3)
    if (range && range[0] < range[1] && (range[2] === 0 || range[0] > 0)) {
      settings.ranges[name] = {
        automatic: false,
        low: range[0],
        high: range[1],
        logarithmic: range[2] === 1,
      }
    }
  }
  const eye = numbers(fields.get('eye'), 20)
  return {
    settings,
    exposure,
    eye: eye && { pose: eye.slice(0, 16), target: [eye[16], eye[17], eye[18]], verticalFov: eye[19] },
  }
}

function numbers(text: string | null, count: number): number[] | null {
  const values = text?.split(',').map(Number) ?? []
  return values.length === count && values.every(Number.isFinite) ? values : null
}

function positive(text: string | null): number | null {
  const value = numbers(text, 1)?.[0] ?? 0
  return value > 0 ? value : null
}
