// SPDX-License-Identifier: Apache-2.0
// Textures of materials: how much of the graphics card they may take, and what shows before they are there.
import type { Matrix3, Vector3 } from 'three'
import { describe, expect, it } from 'vitest'
import type { TextureInfo } from '../src/protocol'
import { Factor, Factors, sideFor } from '../src/three/textures'

const texture: TextureInfo = {
  image: 0,
  mean: [0.5, 0.25, 0],
  wrap: [10497, 33071],
  mag_filter: null,
  min_filter: null,
  matrix: [1, 2, 3, 4, 5, 6],
}
const plain = { name: 'wall', reflectance: texture.mean, emission: texture.mean }
const opaque = { opacity: 1, scattered: 1, by_alpha: false, cut_out: null }
const material = { ...plain, ...opaque, group: null, two_sided: false }

describe('images', () => {
  it('may be as large as all of them fit', () => {
    expect([1, 4, 5, 16, 60, 1000, 100_000].map(sideFor)).toEqual([4096, 4096, 2048, 2048, 1024, 256, 256])
  })

  it('are waited for where surfaces have coordinates', () => {
    const materials = [{ ...material, colour: texture, glow: null }]
    expect(new Factors(materials, true).complete).toBe(false)
    expect(new Factors(materials, false).complete).toBe(true)
    expect(new Factors(materials, false).of).toEqual([{ colour: null, glow: null }])
  })
})

describe('a factor', () => {
  it('is 1 before there are texels, then the texel by the mean, and 1 in channels that are black', () => {
    const factor = new Factor(texture)
    const { glowGain, glowBias, glowMatrix } = factor.uniforms('glow')
    const [gain, bias] = [glowGain.value as Vector3, glowBias.value as Vector3]
    expect([gain.toArray(), bias.toArray()]).toEqual([
      [0, 0, 0],
      [1, 1, 1],
    ])
    factor.show({ width: 1, height: 1 } as ImageBitmap, 4)
    expect([gain.toArray(), bias.toArray()]).toEqual([
      [2, 4, 0],
      [0, 0, 1],
    ])
    expect((glowMatrix.value as Matrix3).transpose().toArray()).toEqual([1, 2, 3, 4, 5, 6, 0, 0, 1])
  })
})
