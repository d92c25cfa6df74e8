// SPDX-License-Identifier: MIT
// Voxels as cones read them, what stands and what moves under one numbering: relumeLiveCells (lib/live_volume.glsl) has
// the bits of all of them.
layout(binding = RELUME_CONE_UNIT_RADIANCE) uniform sampler2D relumeConeRadiance;
layout(binding = RELUME_CONE_UNIT_SIDES) uniform sampler2D relumeConeSides;

ivec2 relumeConeTexel(uint number) {
  return ivec2(number % uint(RELUME_LIVE_SIDES_A_ROW), number / uint(RELUME_LIVE_SIDES_A_ROW));
}

// Toward the front, 127 times the unit vector.
vec3 relumeConeFront(float word) {
  uint axis = uint(word);
  return vec3(axis >> 16 & 255u, axis >> 8 & 255u, axis & 255u) - 128.0;
}

// What a ray of a direction sees of a voxel: radiance times optical depth, and optical depth.
vec4 relumeConeVoxel(uint number, vec3 way) {
  vec4 front = texelFetch(relumeConeRadiance, relumeConeTexel(2u * number), 0);
  vec4 back = texelFetch(relumeConeRadiance, relumeConeTexel(2u * number + 1u), 0);
  return vec4(back.w * (dot(relumeConeFront(front.w), way) < 0.0 ? front.rgb : back.rgb), back.w);
}

// Whether a place is before the opposite side of a voxel rather than before the side that a ray of this direction
// meets.
bool relumeConeIsBehind(uint number, vec3 way, vec3 place) {
  float word = texelFetch(relumeConeRadiance, relumeConeTexel(2u * number), 0).w;
  vec3 texel[4];
  for (uint k = 0u; k < 4u; ++k) texel[k] = texelFetch(relumeConeSides, relumeConeTexel(4u * number + k), 0).xyz;
  float front = dot(place - texel[0], texel[1]), back = dot(place - texel[2], texel[3]);
  return dot(relumeConeFront(word), way) < 0.0 ? front < back : back < front;
}
