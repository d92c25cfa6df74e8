// SPDX-License-Identifier: MIT
// The light of what moves (runtime/cpu/placed_parts.h, which a test compares): one work group a part lights the patches of
// its surface by punctual lights, with the host's shadows, and by last frame's grid, and keeps their mean by area and what
// is seen of them along each view.
// host_visibility.glsl is the host's RelightOptions::visibilityGlsl. It has names of its own: what is global here begins
// with relume, against clashes.
#include "resolve.glsl"
#include "lib/direct_light.glsl"
#include "host_visibility.glsl"

layout(local_size_x = RELUME_PART_GROUP) in;

layout(std430, binding = RELUME_SLOT_LIT_SHAPES) readonly buffer RelumeShapes { uint relumeShapeWord[]; };
layout(std430, binding = RELUME_SLOT_LIGHTS) readonly buffer RelumeLights { RelumeLight relumeLight[]; };
layout(std430, binding = RELUME_SLOT_PARTS) readonly buffer RelumeParts { RelumePart relumePart[]; };
layout(std430, binding = RELUME_SLOT_LIT_PARTS) coherent buffer RelumeMovingLight { vec4 relumeMovingLight[]; };

RELUME_PARAMETERS(RELUME_PART_LIGHT_PARAMETERS)

shared vec4 relumeOwnSum[RELUME_PART_GROUP];  // times area; w: area
shared vec3 relumeBouncedSum[RELUME_PART_GROUP];

const float kRelumePi = 3.14159265;

vec3 relumeShapeVector(uint at) { return uintBitsToFloat(uvec3(relumeShapeWord[at], relumeShapeWord[at + 1u], relumeShapeWord[at + 2u])); }

vec3 relumeDirect(vec3 position, vec3 normal) {
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < relumeLightCount; ++i) {
    vec3 e = relumeDirectIrradiance(relumeLight[i], position, normal, 0.0);
    if (e != vec3(0.0)) sum += e * relumeClampedVisibility(relumeVisibility(i, position, normal));
  }
  return sum;
}

// fromOctahedron() of formats/octahedron.h.
vec3 relumeDirectionOfView(uint view) {
  vec2 p = (2.0 / float(RELUME_VIEW_SIDE)) * (vec2(view % RELUME_VIEW_SIDE, view / RELUME_VIEW_SIDE) + 0.5) - 1.0;
  float z = 1.0 - abs(p.x) - abs(p.y);
  vec2 folded = (1.0 - abs(p.yx)) * mix(vec2(1.0), vec2(-1.0), lessThan(p, vec2(0.0)));
  return normalize(vec3(z >= 0.0 ? p : folded, z));
}

// What the part shows along a view: own light and share of the sphere's disc, bounced light and depth.
void relumeLightView(RelumePart p, uint number, uint view) {
  uint at = relumeShapeWord[p.shape + RELUME_SHAPE_PATCHES] +
            RELUME_SHAPE_PATCH_WORDS * relumeShapeWord[p.shape + RELUME_SHAPE_PATCH_COUNT] + RELUME_VIEW_WORDS * view;
  vec3 own = vec3(0.0), bounced = vec3(0.0);
  for (uint i = 0u; i < RELUME_VIEW_PATCHES; ++i) {
    float weight = uintBitsToFloat(relumeShapeWord[at + 2u + RELUME_VIEW_PATCHES + i]);
    if (!(weight > 0.0)) break;
    uint patch_ = relumeShapeWord[at + 2u + i], light = relumeFirstLight + 2u * (patch_ == kRelumeNone ? number : p.firstPatch + patch_);
    own += weight * relumeMovingLight[light].rgb;
    bounced += weight * relumeMovingLight[light + 1u].rgb;
  }
  vec3 direction = relumeDirectionOfView(view);
  float size = length(direction.x * p.toWorldX + direction.y * p.toWorldY + direction.z * p.toWorldZ);
  uint to = relumeFirstView + 2u * (RELUME_VIEWS * number + view);
  relumeMovingLight[to] = vec4(own, p.viewShare * uintBitsToFloat(relumeShapeWord[at]) / size);
  relumeMovingLight[to + 1u] = vec4(bounced, p.viewDepth * uintBitsToFloat(relumeShapeWord[at + 1u]));
}

void main() {
  uint lane = gl_LocalInvocationID.x, number = relumeFirstPart + gl_WorkGroupID.x;
  RelumePart p = relumePart[number];
  uint patches = relumeShapeWord[p.shape + RELUME_SHAPE_PATCHES], count = relumeShapeWord[p.shape + RELUME_SHAPE_PATCH_COUNT];
  vec4 own = vec4(0.0);
  vec3 bounced = vec3(0.0);
  for (uint i = lane; i < count; i += uint(RELUME_PART_GROUP)) {
    uint at = patches + RELUME_SHAPE_PATCH_WORDS * i;
    vec3 inShape = relumeShapeVector(at + RELUME_PATCH_NORMAL), albedo = relumeShapeVector(at + RELUME_PATCH_ALBEDO);
    // Off the surface by a voxel, since the mean of a curved patch lies below it.
    vec3 lifted = relumeShapeVector(at) + p.voxel * inShape;
    vec3 position = lifted.x * p.toWorldX + lifted.y * p.toWorldY + lifted.z * p.toWorldZ + p.origin;
    vec3 normal = normalize(vec3(dot(p.toGridX, inShape), dot(p.toGridY, inShape), dot(p.toGridZ, inShape)));
    vec3 emission = relumeEmissionScale * relumeShapeVector(at + RELUME_PATCH_EMISSION);
    vec3 e = albedo * relumeDirect(position, normal) + kRelumePi * emission, b = vec3(0.0);
    if (relumeBounceScale > 0.0) b = relumeBounceScale * albedo * relumeIrradianceGrid(position, normal);
    relumeMovingLight[relumeFirstLight + 2u * (p.firstPatch + i)] = vec4(e, 0.0);
    relumeMovingLight[relumeFirstLight + 2u * (p.firstPatch + i) + 1u] = vec4(b, 0.0);
    float area = uintBitsToFloat(relumeShapeWord[at + RELUME_PATCH_AREA]);
    own += area * vec4(e, 1.0);
    bounced += area * b;
  }
  relumeOwnSum[lane] = own;
  relumeBouncedSum[lane] = bounced;
  barrier();
  if (lane == 0u) {
    for (uint i = 1u; i < min(count, uint(RELUME_PART_GROUP)); ++i) {
      own += relumeOwnSum[i];
      bounced += relumeBouncedSum[i];
    }
    float scale = own.w > 0.0 ? 1.0 / own.w : 0.0;
    relumeMovingLight[relumeFirstLight + 2u * number] = vec4(scale * own.rgb, 0.0);
    relumeMovingLight[relumeFirstLight + 2u * number + 1u] = vec4(scale * bounced, 0.0);
  }
  memoryBarrierBuffer();
  barrier();
  for (uint view = lane; view < RELUME_VIEWS; view += uint(RELUME_PART_GROUP)) relumeLightView(p, number, view);
}
