// SPDX-License-Identifier: Apache-2.0
// Numbers, units and times as a reader wants them.
import type { Unit } from './protocol'
import type { ViewMode } from './settings'

export const unitLabel = (unit: Unit): string => (unit === 'lux' ? 'lx' : 'W/m²')

/** Unit of what a view shows. */
export const valueUnit = (mode: ViewMode, unit: Unit): string => (mode === 'error' ? '%' : unitLabel(unit))

/** Three digits, as many zeros as the size needs, a real minus sign. */
export function number(value: number, digits = 3): string {
  if (value === 0) return '0'
  const size = Math.abs(value)
  const exponent = Math.floor(Math.log10(size))
  const text =
    exponent < -4 || exponent > 6
      ? value.toExponential(digits - 1)
      : value.toFixed(Math.min(Math.max(digits - 1 - exponent, 0), 8))
  return text.replace('-', '−')
}

/** A round number of a scale. */
export function tick(value: number, signed = false): string {
  const text = String(Number(value.toPrecision(6))).replace('-', '−')
  return signed && value > 0 ? `+${text}` : text
}

export const count = (value: number): string => Math.round(value).toLocaleString('en-US').replaceAll(',', ' ')

export function milliseconds(value: number): string {
  if (value >= 10_000) return `${(value / 1000).toFixed(0)} s`
  if (value >= 1000) return `${(value / 1000).toFixed(1)} s`
  return value >= 10 ? `${value.toFixed(0)} ms` : `${value.toFixed(1)} ms`
}

export function seconds(value: number): string {
  if (value < 90) return `${Math.max(1, Math.round(value))} s`
  return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`
}

export function bytes(value: number): string {
  if (value < 1e3) return `${value} B`
  return value < 1e6 ? `${(value / 1e3).toFixed(0)} kB` : `${(value / 1e6).toFixed(1)} MB`
}
