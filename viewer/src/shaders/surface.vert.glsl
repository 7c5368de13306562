// SPDX-License-Identifier: Apache-2.0
// Hands the halves of a vertex on as values, and keeps the two sides of one sheet apart.
precision highp float;

in vec4 values;
in vec4 reference;

uniform float valueScale;
uniform float referenceScale;

// Centroid: the middle of a pixel that is covered in part may lie beyond the triangle, which extrapolates.
centroid out vec3 irradiance;
centroid out float standardError;
centroid out vec3 change;
centroid out float uncompared; // above 0 where the reference lacks a value: its error is −1 there
out vec3 worldNormal;
out vec3 toEye;

const float BACK_SIDE_BIAS = 1e-6; // some eight steps of a depth buffer of 24 bits

void main() {
  irradiance = values.rgb * valueScale;
  standardError = values.a * valueScale;
  // The scales are powers of two: equal bits at equal scales leave exactly nothing.
  change = values.rgb * valueScale - reference.rgb * referenceScale;
  uncompared = max(-reference.a, 0.0);
  vec4 world = modelMatrix * vec4(position, 1.0);
  worldNormal = mat3(modelMatrix) * normal;
  toEye = cameraPosition - world.xyz;
  gl_Position = projectionMatrix * viewMatrix * world;
  // A sheet that is lit on both sides is two triangles in one place: the one seen from behind gives way.
  if (dot(worldNormal, toEye) < 0.0) gl_Position.z += BACK_SIDE_BIAS * gl_Position.w;
}
