// SPDX-License-Identifier: Apache-2.0
// Colours a fragment from interpolated linear values: lit, false colours, difference, or for the meter.
// Tone curve as python/deltalux/outputs/tone.py, colours by value as outputs/colour_scale.py.
precision highp float;

centroid in vec3 irradiance;
centroid in float standardError;
centroid in vec3 change;
centroid in float uncompared;
in vec3 worldNormal;
in vec3 toEye;

uniform int mode;
uniform float depthOfPixel; // see the vertex shader
uniform bool measuring; // the values that the mode shows, instead of their colours
uniform vec3 reflectance;
uniform vec3 emission;
uniform bool frontGlows;
uniform bool backGlows;
uniform float exposure;
uniform sampler2D sequential;
uniform sampler2D diverging;
uniform float low;
uniform float high;
uniform bool logarithmic;
uniform bool isolines;
uniform float tickPlaces[MAX_TICKS];
uniform int tickCount;
#if defined(COLOUR_TEXTURE) || defined(GLOW_TEXTURE)
in vec2 coordinates;
uniform bool textures; // whether they are shown
uniform float sharpening;
#endif
#ifdef COLOUR_TEXTURE
uniform sampler2D colourImage;
uniform mat3 colourMatrix;
uniform vec3 colourGain;
uniform vec3 colourBias;
uniform bool colourKnown;
#endif
#ifdef TRANSPARENT
uniform float opacity;
uniform float scattered;
#endif
#ifdef CUT_OUT
uniform float cutOut;
#endif
#ifdef GLOW_TEXTURE
uniform sampler2D glowImage;
uniform mat3 glowMatrix;
uniform vec3 glowGain;
uniform vec3 glowBias;
#endif

out vec4 colour;

const float UNSAMPLED = 0.012; // linear grey of a side that has no samples
const float WHITE = 5.0; // exposed luminance that becomes white
// A triangle that is seen edge-on is a sliver: its corners are rounded to parts of a pixel, and its depth, carried on
// from there, may be that of something far in front. Slopes are times that of a surface at 45 degrees.
const float STEEP = 30.0;
const float UNLIKE_ITS_NORMAL = 8.0; // times the slope that the normal tells
const float STEEP_IN_THE_DARK = 10.0; // of a side without light, of which there is less to lose
const float UNMAPPED = -1e29; // coordinates below it belong to surfaces that have none
const float MOST_FACTOR = 1e3; // of a texel on the mean: black images with a few bright texels
const float LAMP = 0.25; // instead of 1, where a pixel that is measured shows a light source
const float LINE_WIDTH = 0.75; // pixels to either side

float photopic(vec3 rgb) {
  return dot(rgb, vec3(0.2126, 0.7152, 0.0722));
}

vec3 encode(vec3 linear) {
  return mix(12.92 * linear, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, linear));
}

// Reinhard's curve on luminance; a channel beyond 1 pulls the colour towards grey of the same luminance.
vec3 toneMap(vec3 radiance) {
  vec3 exposed = exposure * radiance;
  float luminance = photopic(exposed);
  float shown = min(luminance * (1.0 + luminance / (WHITE * WHITE)) / (1.0 + luminance), 1.0);
  vec3 colour = exposed * (shown / max(luminance, 1e-30));
  float brightest = max(colour.r, max(colour.g, colour.b));
  float chroma = brightest > 1.0 ? (1.0 - shown) / max(brightest - shown, 1e-30) : 1.0;
  return clamp(shown + (colour - shown) * chroma, 0.0, 1.0);
}

float place(float value) {
  if (logarithmic) return log(max(value, 1e-30) / low) / log(high / low);
  return (value - low) / (high - low);
}

vec3 tableColour(sampler2D table, float at) {
  float entry = clamp(at, 0.0, 1.0) * 255.0;
  int first = min(int(entry), 254);
  return mix(texelFetch(table, ivec2(first, 0), 0).rgb, texelFetch(table, ivec2(first + 1, 0), 0).rgb,
             entry - float(first));
}

// 1 on a line where the place passes a tick.
float isoline(float at) {
  float width = max(fwidth(at), 1e-7);
  float nearest = 1e9;
  for (int i = 0; i < tickCount; i++) nearest = min(nearest, abs(at - tickPlaces[i]));
  return 1.0 - smoothstep(LINE_WIDTH, LINE_WIDTH + 0.8, nearest / width);
}

vec3 falseColour(float value) {
  float at = place(value);
  vec3 shown = encode(tableColour(sequential, at));
  if (!isolines) return shown;
  vec3 line = photopic(shown) < 0.35 ? 0.5 * shown + 0.43 : shown / 3.0;
  return mix(shown, line, isoline(at));
}

float relativeError() {
  float value = photopic(irradiance);
  return value > 0.0 ? 100.0 * standardError / value : standardError > 0.0 ? 100.0 : 0.0;
}

bool isSliver() {
  float slope = fwidth(gl_FragCoord.z) / (0.5 * depthOfPixel * gl_FragCoord.w);
  if (gl_FragCoord.z <= 0.0) return true; // clamped, so that it has no slope
  if (!gl_FrontFacing) return slope > STEEP_IN_THE_DARK;
  float facing = abs(dot(normalize(worldNormal), normalize(toEye)));
  return slope > STEEP && slope * facing > UNLIKE_ITS_NORMAL;
}

#if defined(COLOUR_TEXTURE) || defined(GLOW_TEXTURE)
vec3 factor(sampler2D image, mat3 matrix, vec3 gain, vec3 bias) {
  vec3 texel = texture(image, (matrix * vec3(coordinates, 1.0)).xy, -sharpening).rgb; // first: its size comes of neighbours
  if (!textures || coordinates.x < UNMAPPED) return vec3(1.0);
  return min(texel * gain + bias, MOST_FACTOR);
}
#endif

#if defined(BY_ALPHA) || defined(CUT_OUT)
float alphaOfColour() {
  float alpha = texture(colourImage, (colourMatrix * vec3(coordinates, 1.0)).xy).a;
  return colourKnown && coordinates.x >= UNMAPPED ? alpha : 1.0;
}
#endif

// Weight of this colour against that of what is behind, of which it hides a share of the light: colours are mixed as
// they are encoded.
float hiding(float share) {
  return 1.0 - pow(1.0 - share, 1.0 / 2.2);
}

void main() {
  float hidden = 1.0;
#ifdef CUT_OUT
  if (alphaOfColour() < cutOut) discard;
#endif
#ifdef TRANSPARENT
  hidden = opacity;
#endif
#ifdef BY_ALPHA
  hidden *= alphaOfColour();
#endif
  if (measuring && hidden < 0.5) discard;
  if (!measuring && isSliver()) discard; // the pixels that are measured are larger
  bool glows = gl_FrontFacing ? frontGlows : backGlows;
  vec3 light = glows ? emission : vec3(0.0);
  bool sampled = gl_FrontFacing;
  vec3 reflected = reflectance;
#ifdef COLOUR_TEXTURE
  reflected = min(reflected * factor(colourImage, colourMatrix, colourGain, colourBias), 1.0);
#endif
#ifdef GLOW_TEXTURE
  light *= factor(glowImage, glowMatrix, glowGain, glowBias);
#endif
#ifdef TRANSPARENT
  reflected *= scattered;
#endif
  vec3 radiance = reflected * irradiance / 3.14159265358979 + light;

  if (measuring) {
    float value = mode == MODE_FALSE_COLOUR ? photopic(irradiance)
                : mode == MODE_ERROR ? relativeError()
                : mode == MODE_DIFFERENCE ? photopic(change) : photopic(radiance);
    bool counts = sampled && (mode != MODE_DIFFERENCE || uncompared == 0.0);
    float weight = mode == MODE_LIT && light != vec3(0.0) ? LAMP : 1.0;
    colour = vec4(value, counts ? weight : 0.0, 1.0 / gl_FragCoord.w, 1.0);
    return;
  }
  vec3 shown = encode(vec3(UNSAMPLED));
  if (mode == MODE_CLAY) {
    float facing = abs(dot(normalize(worldNormal), normalize(toEye)));
    shown = encode((0.15 + 0.85 * facing) * (0.04 + 0.2 * reflected));
  } else if (mode == MODE_LIT) {
    if (sampled) shown = encode(toneMap(radiance));
  } else if (sampled) {
    if (mode == MODE_FALSE_COLOUR) shown = falseColour(photopic(irradiance));
    if (mode == MODE_ERROR) shown = falseColour(relativeError());
    if (mode == MODE_DIFFERENCE && uncompared == 0.0) {
      shown = encode(tableColour(diverging, place(photopic(change))));
    }
  } else if (mode == MODE_DIFFERENCE) {
    shown = vec3(0.0);
  }
  colour = vec4(shown, hiding(hidden));
}
