// SPDX-License-Identifier: MIT
// Step 2: one thread a sender. Direct light, last frame's caches and emission make the radiosity of the leaves; see
// runtime/cpu/light_surfels.h, which a test compares. host_visibility.glsl is the host's RelightOptions::visibilityGlsl.
#include "resolve.glsl"
#include "lib/pack.glsl"
#include "host_visibility.glsl"

layout(local_size_x = RELUME_SURFEL_GROUP) in;

layout(std430, binding = RELUME_SLOT_SURFELS) readonly buffer Surfels { uint surfelWord[]; };
layout(std430, binding = RELUME_SLOT_LEAF_NODE) readonly buffer LeafNode { uint leafNode[]; };
layout(std430, binding = RELUME_SLOT_LIGHTS) readonly buffer Lights { RelumeLight light[]; };
layout(std430, binding = RELUME_SLOT_HOST) readonly buffer Host { float host[]; };
layout(std430, binding = RELUME_SLOT_NODES) writeonly buffer Nodes { uint node[]; };

// Four words a surfel, then one of emission each, if any emits.
uniform bool relumeEmits;
uniform vec3 relumeBoxOrigin;  // [m] of positions
uniform vec3 relumeBoxStep;
uniform uint relumeSurfelCount;
uniform uint relumeSenderCount;
uniform uint relumeLightCount;
// First float of the host's irradiance, emission and sky patches in `host`; kRelumeNone = not handed over.
uniform uvec3 relumeHostOffset;
uniform vec3 relumeEmissionScale;
uniform vec3 relumeSkyRadiance;  // [W/m²/sr]
uniform float relumeBounceScale;  // 0 also in the first frame

const float kPi = 3.14159265;

vec3 hostColor(uint offset, uint index) {
  uint at = offset + 3u * index;
  return vec3(host[at], host[at + 1u], host[at + 2u]);
}

// Irradiance by one light, shadows left out.
vec3 directIrradiance(RelumeLight l, vec3 position, vec3 normal) {
  if (l.kind == kRelumeDirectional) return l.intensity * max(-dot(l.direction, normal), 0.0);
  vec3 toward = l.positionWorld - position;
  float d2 = dot(toward, toward);
  float cosineTimesD = dot(toward, normal);
  if (!(cosineTimesD > 0.0)) return vec3(0.0);
  float d = sqrt(d2);
  float share = d2 * l.inverseRange2;
  float factor = cosineTimesD / (d * max(d2, 1e-8)) * max(1.0 - share * share, 0.0);
  if (l.kind == kRelumeSpot) {
    float t = clamp((-dot(l.direction, toward / d) - l.cosOuter) * l.coneScale, 0.0, 1.0);
    factor *= t * t;
  }
  return l.intensity * factor;
}

vec3 direct(uint s, vec3 position, vec3 normal) {
  if (relumeHostOffset.x != kRelumeNone) return hostColor(relumeHostOffset.x, s);
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < relumeLightCount; ++i) {
    vec3 e = directIrradiance(light[i], position, normal);
    if (e != vec3(0.0)) sum += e * relumeVisibility(i, position, normal);
  }
  return sum;
}

vec3 radiosityOfSurfel(uint s) {
  uint xy = surfelWord[4u * s], zRG = surfelWord[4u * s + 1u], normalB = surfelWord[4u * s + 2u], receiver = surfelWord[4u * s + 3u];
  vec3 position = relumeBoxOrigin + relumeBoxStep * vec3(xy & 0xFFFFu, xy >> 16, zRG & 0xFFFFu);
  vec3 normal = relumeUnpackDirection(normalB, 12);
  vec3 albedo = vec3((zRG >> 16) & 255u, zRG >> 24, normalB >> 24) / 255.0;
  vec3 e = direct(s, position, normal);
  if (relumeBounceScale > 0.0) {
    vec3 bounced = receiver == kRelumeNone ? relumeIrradianceGrid(position, normal)
                                           : relumeIrradianceLightmap(relumeUnpackUnorm16x2(receiver), normal);
    e += relumeBounceScale * bounced;
  }
  vec3 emission = vec3(0.0);
  if (relumeEmits) emission = relumeUnpackColor(surfelWord[4u * relumeSurfelCount + s]) * relumeEmissionScale;
  if (relumeHostOffset.y != kRelumeNone) emission = hostColor(relumeHostOffset.y, s);
  return albedo * e + kPi * emission;
}

void main() {
  uint s = gl_GlobalInvocationID.x;
  if (s >= relumeSenderCount) return;
  vec3 radiosity;
  if (s < relumeSurfelCount) {
    radiosity = radiosityOfSurfel(s);
  } else {
    bool patches = relumeHostOffset.z != kRelumeNone;
    radiosity = kPi * (patches ? hostColor(relumeHostOffset.z, s - relumeSurfelCount) : relumeSkyRadiance);
  }
  uint leaf = leafNode[s];
  node[leaf] = relumePackColor(radiosity, relumeDither(leaf));
}
