// SPDX-License-Identifier: Apache-2.0
// Thin lines along creases and borders, for views in which most surfaces have one colour.
import { BufferAttribute, BufferGeometry, GLSL3, LineSegments, ShaderMaterial, type Object3D } from 'three'
import type { Body, LitScene } from './litScene'

const vertexShader = /* glsl */ `
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_Position.z -= 2e-5 * gl_Position.w; // in front of the surfaces that meet here
}`

const fragmentShader = /* glsl */ `
precision highp float;
out vec4 colour;
void main() { colour = vec4(0.2, 0.2, 0.22, 1.0); }`

export class Creases {
  private lines: Object3D[] | null = null // made when they are first shown
  private readonly material = new ShaderMaterial({
    glslVersion: GLSL3,
    vertexShader,
    fragmentShader,
    toneMapped: false,
  })

  constructor(private readonly lit: LitScene) {}

  show(on: boolean): void {
    if (!on && !this.lines) return
    this.lines ??= this.lit.bodies.map((body) => this.make(body))
    for (const line of this.lines) line.visible = on
  }

  /** The bodies have other triangles. */
  renew(): void {
    const shown = this.lines?.some((line) => line.visible) ?? false
    for (const line of this.lines ?? []) line.removeFromParent()
    this.lines = null
    this.show(shown)
  }

  private make(body: Body): LineSegments {
    const geometry = new BufferGeometry()
    geometry.setAttribute('position', body.geometry.getAttribute('position'))
    const edges = openEdges(this.lit.corners(body), body.userData.info.vertex_count)
    geometry.setIndex(new BufferAttribute(edges, 1))
    const line = new LineSegments(geometry, this.material)
    body.add(line)
    return line
  }
}

/** Edges of one triangle only, as pairs of vertices: creases have two vertices in one place. */
export function openEdges(triangles: ArrayLike<number>, vertices: number): Uint32Array {
  const keys = new Float64Array(triangles.length)
  for (let corner = 0; corner < triangles.length; corner++) {
    const next = corner % 3 === 2 ? corner - 2 : corner + 1
    const [a, b] = [triangles[corner], triangles[next]]
    keys[corner] = Math.min(a, b) * vertices + Math.max(a, b)
  }
  keys.sort()
  const open = keys.filter((key, i) => key !== keys[i - 1] && key !== keys[i + 1])
  const pairs = new Uint32Array(2 * open.length)
  open.forEach((key, i) => pairs.set([Math.floor(key / vertices), key % vertices], 2 * i))
  return pairs
}
