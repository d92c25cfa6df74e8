// SPDX-License-Identifier: MIT
// Step 2 as a fragment pass, a sender each: direct light, last frame's light where the surfel reads it, and emission make the
// radiosity of the leaves; shaders/light_surfels.comp with the bounce through the textures that hosts resolve with.
#include "resolve.glsl"
precision highp usampler2D;
precision highp sampler2D;
#include "lib/direct_light.glsl"
#include "lib/pack.glsl"
#include "host_visibility.glsl"

uniform usampler2D relumeSurfels;   // runtime/shared/pack_surfel.h
uniform usampler2D relumeLeafNodes;  // node of each sender, whose dither is the CPU backend's
uniform sampler2D relumeEmission;  // [W/m²/sr] with RELUME_EMITS
uniform sampler2D relumeLights;     // RelumeLight, three texels each, in one row
uniform sampler2D relumeHostLight;  // [W/m²] of each surfel, where relumeHostWidth > 0
uniform sampler2D relumeHostEmission;  // [W/m²/sr] of each surfel, where relumeHostEmits
uniform sampler2D relumeSkyPatches;    // [W/m²/sr] of each, in one row, where relumeHostSky
uniform vec3 relumeBoxOrigin;       // [m] of positions
uniform vec3 relumeBoxStep;
uniform float relumeSurfelRadius;  // [m] of a disc of a surfel's area
uniform uint relumeSurfelCount;
uniform uint relumeSenderCount;
uniform uint relumeLightCount;
uniform int relumeHostWidth;  // [texel] of relumeHostLight's rows
uniform bool relumeHostEmits;
uniform bool relumeHostSky;
uniform vec3 relumeEmissionScale;
uniform vec3 relumeSkyRadiance;   // [W/m²/sr]
uniform float relumeBounceScale;  // 0 also in the first frame

layout(location = 0) out uint relumeRadiosity;

const float kRelumePi = 3.14159265;

vec3 relumeDirect(uint s, vec3 position, vec3 normal) {
  if (relumeHostWidth > 0) {
    // A number that is not finite would never leave the bounces.
    vec3 e = texelFetch(relumeHostLight, ivec2(int(s) % relumeHostWidth, int(s) / relumeHostWidth), 0).rgb;
    return relumeFinite(e) ? clamp(e, 0.0, 1e20) : vec3(0.0);
  }
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < relumeLightCount; ++i) {
    int at = 3 * int(i);
    RelumeLight light = RelumeLight(texelFetch(relumeLights, ivec2(at, 0), 0), texelFetch(relumeLights, ivec2(at + 1, 0), 0),
                                    texelFetch(relumeLights, ivec2(at + 2, 0), 0));
    vec3 e = relumeDirectIrradiance(light, position, normal, relumeSurfelRadius);
    if (e != vec3(0.0)) sum += e * relumeClampedVisibility(relumeVisibility(i, position, normal));
  }
  return sum;
}

vec3 relumeRadiosityOfSurfel(uint s) {
  uvec4 word = texelFetch(relumeSurfels, relumeTexelOf(s), 0);
  vec3 position = relumeBoxOrigin + relumeBoxStep * vec3(word.x & 0xFFFFu, word.x >> 16, word.y & 0xFFFFu);
  vec3 normal = relumeUnpackDirection(word.z, 12);
  vec3 albedo = vec3((word.y >> 16) & 255u, word.y >> 24, word.z >> 24) / 255.0;
  vec3 e = relumeDirect(s, position, normal);
  if (relumeBounceScale > 0.0) {
    vec3 bounce;
    if (word.w == kRelumeNone) bounce = relumeIrradianceGrid(position, normal);
    else bounce = relumeIrradianceLightmap(relumeUnpackUnorm16x2(word.w), normal);
    e += relumeBounceScale * bounce;
  }
  vec3 emission = vec3(0.0);
  if (relumeHostEmits) {
    emission = texelFetch(relumeHostEmission, relumeTexelOf(s), 0).rgb;
  }
#if RELUME_EMITS
  else {
    emission = texelFetch(relumeEmission, relumeTexelOf(s), 0).rgb * relumeEmissionScale;
  }
#endif
  return albedo * e + kRelumePi * emission;
}

void main() {
  uint s = uint(gl_FragCoord.y) << 10 | uint(gl_FragCoord.x);
  if (s >= relumeSenderCount) discard;
  vec3 radiosity;
  if (s < relumeSurfelCount) {
    radiosity = relumeRadiosityOfSurfel(s);
  } else {
    radiosity = kRelumePi * (relumeHostSky ? texelFetch(relumeSkyPatches, ivec2(int(s - relumeSurfelCount), 0), 0).rgb : relumeSkyRadiance);
  }
  relumeRadiosity = relumePackColor(radiosity, relumeDither(texelFetch(relumeLeafNodes, relumeTexelOf(s), 0).x));
}
