// SPDX-License-Identifier: MIT
// Step 2: one thread a sender. Direct light, last frame's caches and emission make the radiosity of the leaves; see
// runtime/cpu/light_surfels.h and bounce.h, which a test compares. host_visibility.glsl is the host's
// RelightOptions::visibilityGlsl. It has names of its own: what is global here begins with relume, against clashes.
//
// First come the surfels that read irradiance made once a texel, then those that bounce_surfels.comp has seen to. Buffers
// are read in words of four: software drivers loop over a vector's lanes at every read.
#include "shared/layout.h"
#include "lib/direct_light.glsl"
#include "lib/leaf_node.glsl"
#include "lib/pack.glsl"
#include "host_visibility.glsl"

layout(local_size_x = RELUME_SURFEL_GROUP) in;

layout(std430, binding = RELUME_SLOT_SURFELS) readonly buffer RelumeSurfelWords { uvec4 relumeSurfel[]; };
layout(std430, binding = RELUME_SLOT_LIGHTS) readonly buffer RelumeLights { RelumeLight relumeLight[]; };
layout(std430, binding = RELUME_SLOT_HOST) readonly buffer RelumeHost { vec4 relumeHost[]; };
layout(std430, binding = RELUME_SLOT_NODES) buffer RelumeNodes { uint relumeNode[]; };
layout(std430, binding = RELUME_SLOT_TEXELS) readonly buffer RelumeTexels { uint relumeTexelColor[]; };
layout(std430, binding = RELUME_SLOT_EMISSION) readonly buffer RelumeEmission { uint relumeEmissionColor[]; };
layout(std430, binding = RELUME_SLOT_SURFEL_LIGHT) readonly buffer RelumeSurfelLight { vec4 relumeSurfelLight[]; };

RELUME_PARAMETERS(RELUME_SURFEL_PARAMETERS)

const float kRelumePi = 3.14159265;

vec3 relumeDirect(uint s, vec3 position, vec3 normal) {
  if (relumeLitOnGpu != 0u) {
    // A number that is not finite would never leave the bounces.
    vec3 e = relumeSurfelLight[s].rgb;
    return any(isnan(e)) || any(isinf(e)) ? vec3(0.0) : clamp(e, 0.0, 1e20);
  }
  if (relumeHostOffset.x != kRelumeNone) return relumeHost[relumeHostOffset.x + s].rgb;
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < relumeLightCount; ++i) {
    vec3 e = relumeDirectIrradiance(relumeLight[i], position, normal, relumeSurfelRadius);
    if (e != vec3(0.0)) sum += e * relumeClampedVisibility(relumeVisibility(i, position, normal));
  }
  return sum;
}

// Irradiance of the texels around a point of the light map, those without a cache left out: lightmapStencil() of
// runtime/shared/stencil.h.
vec3 relumeFlatBounce(vec2 uv) {
  vec2 most = vec2(relumeMapSize) - 1.0, p = clamp(uv * vec2(relumeMapSize) - 0.5, vec2(0.0), most);
  uvec2 low = uvec2(p), high = min(low + 1u, relumeMapSize - 1u) - low;
  vec2 f = p - vec2(low), g = 1.0 - f;
  uint at = low.y * relumeMapSize.x + low.x, up = high.y * relumeMapSize.x;
  uvec4 color = uvec4(relumeTexelColor[at], relumeTexelColor[at + high.x], relumeTexelColor[at + up], relumeTexelColor[at + up + high.x]);
  vec4 w = mix(vec4(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y), vec4(0.0), equal(color, uvec4(kRelumeNone)));
  float total = dot(w, vec4(1.0));
  vec3 sum = w.x * relumeUnpackColor(color.x) + w.y * relumeUnpackColor(color.y) + w.z * relumeUnpackColor(color.z) +
             w.w * relumeUnpackColor(color.w);
  return total > 0.0 ? sum / total : vec3(0.0);
}

vec3 relumeRadiosityOfSurfel(uint s, uint leaf) {
  uvec4 word = relumeSurfel[s];
  vec3 position = relumeBoxOrigin + relumeBoxStep * vec3(word.x & 0xFFFFu, word.x >> 16, word.y & 0xFFFFu);
  vec3 normal = relumeUnpackDirection(word.z, 12);
  vec3 albedo = vec3((word.y >> 16) & 255u, word.y >> 24, word.z >> 24) / 255.0;
  vec3 e = relumeDirect(s, position, normal);
  if (relumeBounceScale > 0.0) {
    e += relumeBounceScale * (s < relumeFlatEnd ? relumeFlatBounce(relumeUnpackUnorm16x2(word.w)) : relumeUnpackColor(relumeNode[leaf]));
  }
  vec3 emission = vec3(0.0);
  if (relumeEmits != 0u) emission = relumeUnpackColor(relumeEmissionColor[s]) * relumeEmissionScale;
  if (relumeHostOffset.y != kRelumeNone) emission += relumeHost[relumeHostOffset.y + s].rgb;
  return albedo * e + kRelumePi * emission;
}

void main() {
  uint s = gl_GlobalInvocationID.x;
  if (s >= relumeSenderEnd) return;
  uint leaf = relumeLeafOf(s);
  if (leaf == kRelumeNone) return;
  vec3 radiosity;
  if (s < relumeSurfelEnd) {
    radiosity = relumeRadiosityOfSurfel(s, leaf);
  } else {
    bool patches = relumeHostOffset.z != kRelumeNone;
    radiosity = kRelumePi * (patches ? relumeHost[relumeHostOffset.z + s - relumeSurfelEnd].rgb : relumeSkyRadiance);
  }
  relumeNode[leaf] = relumePackColor(radiosity, relumeDither(leaf));
}
