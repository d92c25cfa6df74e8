// SPDX-License-Identifier: MIT
// The sky as cones see it: skyAlong() of runtime/live/live_sky.h; and the cones of the hemisphere beside its map.
layout(std430, binding = RELUME_CONE_SLOT_DIRECTIONS) readonly buffer ConeDirections { vec4 coneDirection[]; };
uniform uvec2 relumeConeSky;         // where its map begins, and the map's side; 0 = it has none
uniform vec3 relumeConeSkyRadiance;  // [W/m²/sr]

vec3 relumeSkyTexel(ivec2 at) {
  return coneDirection[relumeConeSky.x + uint(at.y) * relumeConeSky.y + uint(at.x)].rgb;
}

vec3 relumeSkyAlong(vec3 way) {
  if (relumeConeSky.y == 0u) return relumeConeSkyRadiance;
  float sum = abs(way.x) + abs(way.y) + abs(way.z);
  vec2 p = way.xy / sum;
  if (way.z < 0.0) p = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
  p = (p * 0.5 + 0.5) * float(relumeConeSky.y) - 0.5;
  ivec2 last = ivec2(relumeConeSky.y) - 1, low = clamp(ivec2(floor(p)), ivec2(0), last);
  ivec2 high = clamp(ivec2(floor(p)) + 1, ivec2(0), last);
  vec2 f = p - floor(p);
  return mix(mix(relumeSkyTexel(low), relumeSkyTexel(ivec2(high.x, low.y)), f.x),
             mix(relumeSkyTexel(ivec2(low.x, high.y)), relumeSkyTexel(high), f.x), f.y);
}
