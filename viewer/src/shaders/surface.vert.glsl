// SPDX-License-Identifier: Apache-2.0
// Hands the halves of a vertex on as values, and keeps the two sides of one sheet apart.
precision highp float;

in vec4 values;
in vec4 reference;

uniform float valueScale;
uniform float referenceScale;
uniform float depthOfPixel; // change of depth, before the division, over a pixel of a surface at 45 degrees

// Centroid: the middle of a pixel that is covered in part may lie beyond the triangle, which extrapolates.
centroid out vec3 irradiance;
centroid out float standardError;
centroid out vec3 change;
centroid out float uncompared; // above 0 where the reference lacks a value: its error is −1 there
out vec3 worldNormal;
out vec3 toEye;
#if defined(COLOUR_TEXTURE) || defined(GLOW_TEXTURE)
out vec2 coordinates;
#endif

const float BACK_SIDE_BIAS = 1e-6; // some eight steps of a depth buffer of 24 bits
const float PIXELS = 2.0; // how far from an outline the depths of two faces that meet there may be mixed up
const float EDGE_ON = 0.01; // least cosine that counts: what is seen more edge-on is narrower than a pixel

void main() {
  irradiance = values.rgb * valueScale;
  standardError = values.a * valueScale;
  // The scales are powers of two: equal bits at equal scales leave exactly nothing.
  change = values.rgb * valueScale - reference.rgb * referenceScale;
  uncompared = max(-reference.a, 0.0);
  vec4 world = modelMatrix * vec4(position, 1.0);
  worldNormal = mat3(modelMatrix) * normal;
  toEye = cameraPosition - world.xyz;
#if defined(COLOUR_TEXTURE) || defined(GLOW_TEXTURE)
  coordinates = uv;
#endif
  gl_Position = projectionMatrix * viewMatrix * world;
  // A sheet that is lit on both sides is two triangles in one place: the one seen from behind gives way. So does
  // the far side of a body at its outline, where corners rounded to parts of a pixel would let it come forward.
  float facing = dot(normalize(worldNormal), normalize(toEye));
  if (facing < 0.0) {
    float steepness = 1.0 / max(-facing, EDGE_ON);
    gl_Position.z += BACK_SIDE_BIAS * gl_Position.w + PIXELS * depthOfPixel * steepness;
  }
}
