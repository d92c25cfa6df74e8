// SPDX-License-Identifier: MIT
// Optical depth and what is seen through it, as runtime/cones/radiance_mips.cpp has both. Logarithm and exponential
// keep their precision near 1 and 0, where voxels of high levels have theirs.
const float kConeSolid = 7.0;  // optical depth of a voxel of a wall

// Of a voxel by 127 times its axis, without signs. A wall has one voxel in each column along its longest axis, and so
// fewer to its area where it is slanted.
float relumeConeDepthOfWall(vec3 axis) { return kConeSolid * 127.0 / max(max(axis.x, axis.y), max(axis.z, 1.0)); }

// 1 - exp(-x). [x >= 0]
float relumeBlocked(float x) {
  if (x > 0.4) return 1.0 - exp(-x);
  float y = 1.0 - x / 7.0;
  y = 1.0 - x / 6.0 * y;
  y = 1.0 - x / 5.0 * y;
  y = 1.0 - x / 4.0 * y;
  y = 1.0 - x / 3.0 * y;
  return x * (1.0 - x / 2.0 * y);
}

// -log(1 - x), by log(m) = 2 atanh((m - 1) / (m + 1)). [0 <= x < 1]
float relumeDepthOfOpacity(float x) {
  int exponent = 0;
  float less = -x;
  if (x > 0.25) {
    float m = frexp(1.0 - x, exponent);
    if (m < 0.70710678) {
      m *= 2.0;
      --exponent;
    }
    less = m - 1.0;
  }
  float s = less / (2.0 + less), t = s * s;
  return -2.0 * s * (1.0 + t * (1.0 / 3.0 + t * (1.0 / 5.0 + t * (1.0 / 7.0 + t / 9.0)))) -
         0.693147181 * float(exponent);
}

// Radiance times opacity, and opacity.
vec4 relumeSeenThrough(vec4 depth) {
  if (!(depth.w > 0.0)) return vec4(0.0);
  float opacity = relumeBlocked(depth.w);
  return vec4(depth.rgb * (opacity / depth.w), opacity);
}

vec4 relumeDepthOf(vec4 seen) {
  if (!(seen.w > 0.0)) return vec4(0.0);
  float depth = min(relumeDepthOfOpacity(min(seen.w, 0.9999)), kConeSolid);
  return vec4(seen.rgb * (depth / seen.w), depth);
}

vec4 relumeBehind(vec4 near, vec4 far) { return near + (1.0 - near.w) * far; }

// The 2 x 2 x 2 parts of a voxel, seen along one of six directions: the mean of four columns. With one direction for
// all, the mean of all parts.
vec4 relumeConeTogether(vec4 part[8], uint direction) {
  vec4 seen[8], sum = vec4(0.0);
  for (int i = 0; i < 8; ++i) seen[i] = relumeSeenThrough(part[i]);
#if RELUME_CONE_DIRECTIONS == 1
  for (int i = 0; i < 8; ++i) sum += 0.125 * seen[i];
#else
  bool isUp = direction % 2u == 0u;
  if (direction < 2u) {
    for (int i = 0; i < 8; i += 2) sum += 0.25 * relumeBehind(seen[isUp ? i : i + 1], seen[isUp ? i + 1 : i]);
  } else if (direction < 4u) {
    for (int k = 0; k < 4; ++k) {
      int i = (k & 1) + 4 * (k >> 1);
      sum += 0.25 * relumeBehind(seen[isUp ? i : i + 2], seen[isUp ? i + 2 : i]);
    }
  } else {
    for (int i = 0; i < 4; ++i) sum += 0.25 * relumeBehind(seen[isUp ? i : i + 4], seen[isUp ? i + 4 : i]);
  }
#endif
  return relumeDepthOf(sum);
}

// A ray's direction along an axis, of the six: +x, -x, +y, -y, +z, -z.
vec3 relumeConeAxis(uint direction) {
  vec3 axis = vec3(0.0);
  axis[direction / 2u] = direction % 2u == 0u ? 1.0 : -1.0;
  return axis;
}
