// SPDX-License-Identifier: Apache-2.0
// Textures of materials: factors on their mean colours, from images that come after the first picture.
import {
  ClampToEdgeWrapping,
  LinearFilter,
  LinearMipmapLinearFilter,
  LinearMipmapNearestFilter,
  Matrix3,
  MirroredRepeatWrapping,
  NearestFilter,
  NearestMipmapLinearFilter,
  NearestMipmapNearestFilter,
  RepeatWrapping,
  SRGBColorSpace,
  Texture,
  Vector3,
  type IUniform,
  type MagnificationTextureFilter,
  type MinificationTextureFilter,
  type Wrapping,
} from 'three'
import type { MaterialInfo, TextureInfo } from '../protocol'

const MOST_TEXELS = 2 ** 26 // of all images together; 360 MB of the graphics card
const [LEAST_SIDE, MOST_SIDE] = [256, 4096]

// OpenGL's numbers, which are glTF's.
const WRAPPINGS: Record<number, Wrapping> = {
  10497: RepeatWrapping,
  33071: ClampToEdgeWrapping,
  33648: MirroredRepeatWrapping,
}
const FILTERS: Record<number, MinificationTextureFilter> = {
  9728: NearestFilter,
  9729: LinearFilter,
  9984: NearestMipmapNearestFilter,
  9985: LinearMipmapNearestFilter,
  9986: NearestMipmapLinearFilter,
  9987: LinearMipmapLinearFilter,
}

/** Texels along a side that each of so many images may have. */
export function sideFor(images: number): number {
  const side = 2 ** Math.floor(Math.log2(Math.sqrt(MOST_TEXELS / Math.max(images, 1))))
  return Math.min(Math.max(side, LEAST_SIDE), MOST_SIDE)
}

/** A factor on the reflectance or emission of a material: texel × gain + bias; 1 until there are texels. */
export class Factor {
  private readonly image: IUniform<Texture | null> = { value: null }
  private readonly gain = new Vector3(0, 0, 0)
  private readonly bias = new Vector3(1, 1, 1)
  private readonly known: IUniform<boolean> = { value: false }

  constructor(readonly info: TextureInfo) {}

  /** Uniforms of the shader, by the name of the factor. */
  uniforms(name: string): Record<string, IUniform> {
    const [a, b, c, d, e, f] = this.info.matrix
    return {
      [`${name}Image`]: this.image,
      [`${name}Matrix`]: { value: new Matrix3(a, b, c, d, e, f, 0, 0, 1) },
      [`${name}Gain`]: { value: this.gain },
      [`${name}Bias`]: { value: this.bias },
      [`${name}Known`]: this.known,
    }
  }

  /** Shows an image, whose mean then looks as the material without it. */
  show(image: ImageBitmap, anisotropy: number): void {
    const { wrap, mag_filter, min_filter, mean } = this.info
    const texture = new Texture(image)
    texture.wrapS = WRAPPINGS[wrap[0]]
    texture.wrapT = WRAPPINGS[wrap[1]]
    if (mag_filter !== null) texture.magFilter = FILTERS[mag_filter] as MagnificationTextureFilter
    if (min_filter !== null) texture.minFilter = FILTERS[min_filter]
    texture.colorSpace = SRGBColorSpace
    texture.flipY = false // as in glTF, (0, 0) is the upper left corner
    texture.anisotropy = texture.minFilter === LinearMipmapLinearFilter ? anisotropy : 1
    texture.needsUpdate = true
    this.image.value = texture
    this.known.value = true
    this.gain.set(...(mean.map((value) => (value > 0 ? 1 / value : 0)) as [number, number, number]))
    this.bias.set(...(mean.map((value) => (value > 0 ? 0 : 1)) as [number, number, number]))
  }
}

/** Both factors of every material of a scene, null where it has none. */
export class Factors {
  readonly of: { colour: Factor | null; glow: Factor | null }[]
  begun = false
  private coming = 0

  /** `shown`: surfaces have texture coordinates. */
  constructor(materials: MaterialInfo[], shown: boolean) {
    const factor = (info: TextureInfo | null) => (info && shown ? new Factor(info) : null)
    this.of = materials.map(({ colour, glow }) => ({ colour: factor(colour), glow: factor(glow) }))
  }

  private get all(): Factor[] {
    return this.of.flatMap(({ colour, glow }) => [colour, glow]).filter((factor) => factor !== null)
  }

  get any(): boolean {
    return this.all.length > 0
  }

  /** Every image was asked for, and is there or failed. */
  get complete(): boolean {
    return !this.any || (this.begun && this.coming === 0)
  }

  /**
   * Fetches the images, one after the other.
   * `address`: of an image; `came`: one more is there; `failed`: receives why one is not.
   */
  async load(
    address: (image: number) => string,
    anisotropy: number,
    came: () => void,
    failed: (reason: string) => void,
  ): Promise<void> {
    this.begun = true
    const users = new Map<number, Factor[]>()
    for (const factor of this.all) {
      users.set(factor.info.image, [...(users.get(factor.info.image) ?? []), factor])
    }
    const side = sideFor(users.size)
    this.coming = users.size
    for (const [image, factors] of users) {
      try {
        const bitmap = await fetchImage(address(image), side)
        for (const factor of factors) factor.show(bitmap, anisotropy)
      } catch (error) {
        failed(error instanceof Error ? error.message : String(error))
      }
      this.coming--
      came()
    }
  }
}

/** An image, halved until no side is longer than `most`. */
async function fetchImage(address: string, most: number): Promise<ImageBitmap> {
  const answer = await fetch(address)
  if (!answer.ok) throw new Error(`the server answered ${answer.status}`)
  const options: ImageBitmapOptions = { premultiplyAlpha: 'none', colorSpaceConversion: 'none' }
  const whole = await createImageBitmap(await answer.blob(), options)
  const times = Math.max(Math.ceil(Math.log2(Math.max(whole.width, whole.height) / most)), 0)
  if (times === 0) return whole
  const half = (length: number) => Math.max(Math.round(length / 2 ** times), 1)
  const smaller = await createImageBitmap(whole, {
    ...options,
    resizeWidth: half(whole.width),
    resizeHeight: half(whole.height),
    resizeQuality: 'high',
  })
  whole.close()
  return smaller
}
