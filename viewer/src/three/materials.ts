// SPDX-License-Identifier: Apache-2.0
// Shader materials of surfaces: one program and shared uniforms, reflectance and emission of each.
import {
  Color,
  DataTexture,
  DoubleSide,
  FloatType,
  FrontSide,
  GLSL3,
  NearestFilter,
  RGBAFormat,
  ShaderMaterial,
  type IUniform,
} from 'three'
import {
  colourTable,
  DIVERGING,
  position,
  SEQUENTIAL,
  TABLE_SIZE,
  ticks,
  type ColourScale,
} from '../colourScale'
import type { MaterialInfo, Rgb } from '../protocol'
import fragmentShader from '../shaders/surface.frag.glsl?raw'
import vertexShader from '../shaders/surface.vert.glsl?raw'
import type { Factors } from './textures'

export const MODES = { lit: 0, falseColour: 1, error: 2, difference: 3, clay: 4 } as const
export type ShaderMode = keyof typeof MODES

const MAX_TICKS = 32

function tableTexture(table: Float32Array): DataTexture {
  const texture = new DataTexture(
    table,
    TABLE_SIZE,
    1,
    RGBAFormat,
    FloatType,
    undefined,
    undefined,
    undefined,
    NearestFilter,
    NearestFilter,
  )
  texture.needsUpdate = true
  return texture
}

function isTransparent({ opacity, by_alpha }: MaterialInfo): boolean {
  return opacity < 1 || by_alpha
}

/** Reversed, closed; in the order of SurfaceMaterials.index. */
const VARIANTS: [boolean, boolean][] = [
  [false, false],
  [false, true],
  [true, false],
  [true, true],
]

/** The materials of a scene, by (material, reversed, closed). */
export class SurfaceMaterials {
  readonly shared = {
    mode: { value: MODES.clay as number },
    measuring: { value: false },
    valueScale: { value: 1 },
    referenceScale: { value: 1 },
    depthOfPixel: { value: 0 },
    exposure: { value: 1 },
    sequential: { value: tableTexture(colourTable(SEQUENTIAL)) },
    diverging: { value: tableTexture(colourTable(DIVERGING)) },
    low: { value: 0 },
    high: { value: 1 },
    logarithmic: { value: false },
    isolines: { value: false },
    textures: { value: true },
    sharpening: { value: 0 }, // levels of images that are finer than the pixels ask for
    tickPlaces: { value: new Array<number>(MAX_TICKS).fill(0) },
    tickCount: { value: 0 },
  } satisfies Record<string, IUniform>

  private readonly materials: ShaderMaterial[] = []

  constructor(
    private readonly infos: MaterialInfo[],
    factors: Factors,
  ) {
    infos.forEach((info, i) => {
      for (const variant of VARIANTS) this.materials.push(this.make(info, factors.of[i], ...variant))
    })
  }

  /**
   * Index of a material for triangles whose sampled side is the front, or (reversed) the back, of a mesh that is
   * closed, or not.
   */
  static index(material: number, reversed: boolean, closed: boolean): number {
    return VARIANTS.length * material + (reversed ? 2 : 0) + (closed ? 1 : 0)
  }

  /** Every material, in the order of `index`. */
  get all(): ShaderMaterial[] {
    return this.materials
  }

  /** One of each program: for closed meshes and for others, with textures and without. */
  get programs(): ShaderMaterial[] {
    const key = ({ side, defines }: ShaderMaterial) => [side, ...Object.keys(defines)].join()
    return [...new Map(this.materials.map((material) => [key(material), material])).values()]
  }

  setReflectance(name: string, value: Rgb): void {
    this.infos.forEach((info, i) => {
      if (info.name === name) this.setColour(i, 'reflectance', value)
    })
  }

  /** Dims what shines by the factors of its light groups. */
  setFactors(factors: Record<string, number>): void {
    this.infos.forEach(({ emission, group }, i) => {
      const factor = group === null ? undefined : factors[group]
      if (factor !== undefined) this.setColour(i, 'emission', emission.map((value) => factor * value) as Rgb)
    })
  }

  private setColour(material: number, uniform: 'reflectance' | 'emission', value: Rgb): void {
    for (const variant of VARIANTS) {
      const { uniforms } = this.materials[SurfaceMaterials.index(material, ...variant)]
      ;(uniforms[uniform].value as Color).setRGB(...value)
    }
  }

  setScale(scale: ColourScale): void {
    const places = ticks(scale)
      .slice(0, MAX_TICKS)
      .map((value) => position(scale, value))
    this.shared.low.value = scale.low
    this.shared.high.value = scale.high
    this.shared.logarithmic.value = scale.logarithmic
    this.shared.tickCount.value = places.length
    places.forEach((place, i) => (this.shared.tickPlaces.value[i] = place))
  }

  private make(
    info: MaterialInfo,
    { colour, glow }: Factors['of'][number],
    reversed: boolean,
    closed: boolean,
  ): ShaderMaterial {
    const modes = Object.entries(MODES).map(([name, value]) => [
      `MODE_${name.replace(/[A-Z]/g, (c) => `_${c}`).toUpperCase()}`,
      value,
    ])
    return new ShaderMaterial({
      name: info.name,
      glslVersion: GLSL3,
      vertexShader,
      fragmentShader,
      defines: {
        ...Object.fromEntries(modes),
        MAX_TICKS,
        ...(colour && { COLOUR_TEXTURE: 1 }),
        ...(glow && { GLOW_TEXTURE: 1 }),
        ...(info.opacity < 1 && { TRANSPARENT: 1 }),
        ...(colour && info.by_alpha && { BY_ALPHA: 1 }),
        ...(colour && info.cut_out !== null && { CUT_OUT: 1 }),
      },
      // What shows of a back behind its own front, at an edge, are rounding errors of depth. Both sides of a pane
      // would dim twice what is behind.
      side: closed || isTransparent(info) ? FrontSide : DoubleSide,
      transparent: isTransparent(info),
      depthWrite: !isTransparent(info),
      toneMapped: false,
      uniforms: {
        ...this.shared,
        reflectance: { value: new Color().setRGB(...info.reflectance) },
        emission: { value: new Color().setRGB(...info.emission) },
        opacity: { value: info.opacity },
        scattered: { value: info.scattered },
        cutOut: { value: info.cut_out ?? 0 },
        frontGlows: { value: info.two_sided || !reversed },
        backGlows: { value: info.two_sided || reversed },
        ...colour?.uniforms('colour'),
        ...glow?.uniforms('glow'),
      },
    })
  }
}
