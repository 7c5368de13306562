// SPDX-License-Identifier: Apache-2.0
// A pass over all pixels of the target, by a fragment shader that reads textures; `place` is 0 to 1 from the bottom left.
import { GLSL3, ShaderMaterial, type IUniform } from 'three'
import { FullScreenQuad } from 'three/addons/postprocessing/Pass.js'

const vertexShader = /* glsl */ `
out vec2 place;
void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }`

export function screenPass(fragmentShader: string, uniforms: Record<string, IUniform>): FullScreenQuad {
  return new FullScreenQuad(
    new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader,
      fragmentShader,
      depthTest: false,
      depthWrite: false,
      toneMapped: false,
      uniforms,
    }),
  )
}
