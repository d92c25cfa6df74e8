// SPDX-License-Identifier: MIT
// The light of what moves (runtime/cpu/placed_parts.h, which a test compares): one work group a part lights the patches of
// its surface by punctual lights, with the host's shadows, and by last frame's grid, and keeps their mean by area and what
// is seen of them along each view.
// host_visibility.glsl is the host's RelightOptions::visibilityGlsl.
#include "resolve.glsl"
#include "lib/direct_light.glsl"
#include "host_visibility.glsl"

layout(local_size_x = RELUME_PART_GROUP) in;

layout(std430, binding = RELUME_SLOT_LIT_SHAPES) readonly buffer Shapes { uint shapeWord[]; };
layout(std430, binding = RELUME_SLOT_LIGHTS) readonly buffer Lights { RelumeLight light[]; };
layout(std430, binding = RELUME_SLOT_PARTS) readonly buffer Parts { RelumePart part[]; };
layout(std430, binding = RELUME_SLOT_LIT_PARTS) coherent buffer MovingLight { vec4 movingLight[]; };

RELUME_PARAMETERS(RELUME_PART_LIGHT_PARAMETERS)

shared vec4 ownSum[RELUME_PART_GROUP];  // times area; w: area
shared vec3 bouncedSum[RELUME_PART_GROUP];

const float kPi = 3.14159265;

vec3 shapeVector(uint at) { return uintBitsToFloat(uvec3(shapeWord[at], shapeWord[at + 1u], shapeWord[at + 2u])); }

vec3 direct(vec3 position, vec3 normal) {
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < relumeLightCount; ++i) {
    vec3 e = relumeDirectIrradiance(light[i], position, normal);
    if (e != vec3(0.0)) sum += e * relumeClampedVisibility(relumeVisibility(i, position, normal));
  }
  return sum;
}

// fromOctahedron() of formats/octahedron.h.
vec3 directionOfView(uint view) {
  vec2 p = (2.0 / float(RELUME_VIEW_SIDE)) * (vec2(view % RELUME_VIEW_SIDE, view / RELUME_VIEW_SIDE) + 0.5) - 1.0;
  float z = 1.0 - abs(p.x) - abs(p.y);
  vec2 folded = (1.0 - abs(p.yx)) * mix(vec2(1.0), vec2(-1.0), lessThan(p, vec2(0.0)));
  return normalize(vec3(z >= 0.0 ? p : folded, z));
}

// What the part shows along a view: own light and share of the sphere's disc, bounced light and depth.
void lightView(RelumePart p, uint number, uint view) {
  uint at = shapeWord[p.shape + RELUME_SHAPE_PATCHES] +
            RELUME_SHAPE_PATCH_WORDS * shapeWord[p.shape + RELUME_SHAPE_PATCH_COUNT] + RELUME_VIEW_WORDS * view;
  vec3 own = vec3(0.0), bounced = vec3(0.0);
  for (uint i = 0u; i < RELUME_VIEW_PATCHES; ++i) {
    float weight = uintBitsToFloat(shapeWord[at + 2u + RELUME_VIEW_PATCHES + i]);
    if (!(weight > 0.0)) break;
    uint patch_ = shapeWord[at + 2u + i], light = relumeFirstLight + 2u * (patch_ == kRelumeNone ? number : p.firstPatch + patch_);
    own += weight * movingLight[light].rgb;
    bounced += weight * movingLight[light + 1u].rgb;
  }
  vec3 direction = directionOfView(view);
  float size = length(direction.x * p.toWorldX + direction.y * p.toWorldY + direction.z * p.toWorldZ);
  uint to = relumeFirstView + 2u * (RELUME_VIEWS * number + view);
  movingLight[to] = vec4(own, p.viewShare * uintBitsToFloat(shapeWord[at]) / size);
  movingLight[to + 1u] = vec4(bounced, p.viewDepth * uintBitsToFloat(shapeWord[at + 1u]));
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
  if (lane == 0u) {
    for (uint i = 1u; i < min(count, uint(RELUME_PART_GROUP)); ++i) {
      own += ownSum[i];
      bounced += bouncedSum[i];
    }
    float scale = own.w > 0.0 ? 1.0 / own.w : 0.0;
    movingLight[relumeFirstLight + 2u * number] = vec4(scale * own.rgb, 0.0);
    movingLight[relumeFirstLight + 2u * number + 1u] = vec4(scale * bounced, 0.0);
  }
  memoryBarrierBuffer();
  barrier();
  for (uint view = lane; view < RELUME_VIEWS; view += uint(RELUME_PART_GROUP)) lightView(p, number, view);
}
