// SPDX-License-Identifier: MIT
// The light of what moves (runtime/cpu/placed_parts.h, which a test compares): one work group a part lights the patches of
// its surface by punctual lights, with the host's shadows, and by last frame's grid, and keeps their mean by area.
// host_visibility.glsl is the host's RelightOptions::visibilityGlsl.
#include "resolve.glsl"
#include "lib/direct_light.glsl"
#include "host_visibility.glsl"

layout(local_size_x = RELUME_PART_GROUP) in;

layout(std430, binding = RELUME_SLOT_LIT_SHAPES) readonly buffer Shapes { uint shapeWord[]; };
layout(std430, binding = RELUME_SLOT_LIGHTS) readonly buffer Lights { RelumeLight light[]; };
layout(std430, binding = RELUME_SLOT_PARTS) readonly buffer Parts { RelumePart part[]; };
layout(std430, binding = RELUME_SLOT_MOVING_LIGHT) writeonly buffer MovingLight { vec4 movingLight[]; };

RELUME_PARAMETERS(RELUME_PART_LIGHT_PARAMETERS)

shared vec4 ownSum[RELUME_PART_GROUP];  // times area; w: area
shared vec3 bouncedSum[RELUME_PART_GROUP];

const float kPi = 3.14159265;

vec3 shapeVector(uint at) { return uintBitsToFloat(uvec3(shapeWord[at], shapeWord[at + 1u], shapeWord[at + 2u])); }

vec3 direct(vec3 position, vec3 normal) {
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < relumeLightCount; ++i) {
    vec3 e = relumeDirectIrradiance(light[i], position, normal);
    if (e == vec3(0.0)) continue;
    // A number of the host's that is not finite would never leave the bounces.
    float visible = relumeVisibility(i, position, normal);
    if (relumeFinite(visible)) sum += e * clamp(visible, 0.0, 1.0);
  }
  return sum;
}

void main() {
  uint lane = gl_LocalInvocationID.x, number = relumeFirstPart + gl_WorkGroupID.x;
  RelumePart p = part[number];
  uint patches = shapeWord[p.shape + RELUME_SHAPE_PATCHES], count = shapeWord[p.shape + RELUME_SHAPE_PATCH_COUNT];
  vec4 own = vec4(0.0);
  vec3 bounced = vec3(0.0);
  for (uint i = lane; i < count; i += uint(RELUME_PART_GROUP)) {
    uint at = patches + RELUME_SHAPE_PATCH_WORDS * i;
    vec3 inShape = shapeVector(at + RELUME_PATCH_NORMAL), albedo = shapeVector(at + RELUME_PATCH_ALBEDO);
    // Off the surface by a voxel, since the mean of a curved patch lies below it.
    vec3 lifted = shapeVector(at) + p.voxel * inShape;
    vec3 position = lifted.x * p.toWorldX + lifted.y * p.toWorldY + lifted.z * p.toWorldZ + p.origin;
    vec3 normal = normalize(vec3(dot(p.toGridX, inShape), dot(p.toGridY, inShape), dot(p.toGridZ, inShape)));
    vec3 e = albedo * direct(position, normal) + kPi * shapeVector(at + RELUME_PATCH_EMISSION), b = vec3(0.0);
    if (relumeBounceScale > 0.0) b = relumeBounceScale * albedo * relumeIrradianceGrid(position, normal);
    movingLight[relumeFirstLight + 2u * (p.firstPatch + i)] = vec4(e, 0.0);
    movingLight[relumeFirstLight + 2u * (p.firstPatch + i) + 1u] = vec4(b, 0.0);
    float area = uintBitsToFloat(shapeWord[at + RELUME_PATCH_AREA]);
    own += area * vec4(e, 1.0);
    bounced += area * b;
  }
  ownSum[lane] = own;
  bouncedSum[lane] = bounced;
  barrier();
  if (lane != 0u) return;
  for (uint i = 1u; i < min(count, uint(RELUME_PART_GROUP)); ++i) {
    own += ownSum[i];
    bounced += bouncedSum[i];
  }
  float scale = own.w > 0.0 ? 1.0 / own.w : 0.0;
  movingLight[relumeFirstLight + 2u * number] = vec4(scale * own.rgb, 0.0);
  movingLight[relumeFirstLight + 2u * number + 1u] = vec4(scale * bounced, 0.0);
}
