// SPDX-License-Identifier: Apache-2.0
// Materials follow the session's state: reflectances by name, emissions by their light groups.
import { DoubleSide, FrontSide, type Color } from 'three'
import { describe, expect, it } from 'vitest'
import type { MaterialInfo, Rgb } from '../src/protocol'
import { SurfaceMaterials } from '../src/three/materials'
import { Factors } from '../src/three/textures'

const OPAQUE = { opacity: 1, scattered: 1, by_alpha: false, cut_out: null }

const info = (name: string, emission: Rgb, group: string | null): MaterialInfo => {
  const looks = { colour: null, glow: null, two_sided: false, ...OPAQUE }
  return { name, reflectance: [0.5, 0.5, 0.5], emission, group, ...looks }
}

function uniform(materials: SurfaceMaterials, material: number, name: string): number[][] {
  const sides = [false, true].flatMap((a) => [false, true].map((b) => SurfaceMaterials.index(material, a, b)))
  return sides.map((i) => (materials.all[i].uniforms[name].value as Color).toArray())
}

const four = <T>(value: T): T[] => Array.from({ length: 4 }, () => value)

describe('materials', () => {
  const infos = [
    info('wall', [0, 0, 0], null),
    info('glow', [8, 4, 2], 'left'),
    info('glow', [8, 4, 2], 'right'),
    info('screen', [1, 1, 1], 'desk'),
  ]
  const materials = new SurfaceMaterials(infos, new Factors(infos, false))

  it('hide what is behind them, but for panes, which are drawn last and on one side', () => {
    const pane = { ...infos[0], opacity: 0.1, scattered: 0 }
    const { all } = new SurfaceMaterials([infos[0], pane], new Factors([infos[0], pane], false))
    const of = (material: number) => all[SurfaceMaterials.index(material, false, false)]
    expect([of(0).transparent, of(0).depthWrite, of(0).side]).toEqual([false, true, DoubleSide])
    expect([of(1).transparent, of(1).depthWrite, of(1).side]).toEqual([true, false, FrontSide])
    expect(of(1).uniforms.opacity.value).toBe(0.1)
  })

  it('shine as their groups are dimmed, each by itself', () => {
    materials.setFactors({ left: 0.25, right: 0, other: 7 })
    expect(uniform(materials, 0, 'emission')).toEqual(four([0, 0, 0]))
    expect(uniform(materials, 1, 'emission')).toEqual(four([2, 1, 0.5]))
    expect(uniform(materials, 2, 'emission')).toEqual(four([0, 0, 0]))
    expect(uniform(materials, 3, 'emission')).toEqual(four([1, 1, 1]))
    materials.setFactors({ left: 1, right: 2, desk: 0.5 })
    expect(uniform(materials, 1, 'emission')).toEqual(four([8, 4, 2]))
    expect(uniform(materials, 2, 'emission')).toEqual(four([16, 8, 4]))
    expect(uniform(materials, 3, 'emission')).toEqual(four([0.5, 0.5, 0.5]))
  })

  it('of one name reflect alike', () => {
    materials.setReflectance('glow', [0.1, 0.2, 0.3])
    for (const i of [1, 2]) expect(uniform(materials, i, 'reflectance')).toEqual(four([0.1, 0.2, 0.3]))
    for (const i of [0, 3]) expect(uniform(materials, i, 'reflectance')).toEqual(four([0.5, 0.5, 0.5]))
    materials.setReflectance('unknown', [1, 1, 1])
  })
})
