// SPDX-License-Identifier: MIT
// What a pixel's place had in the frame before joins what it has now, where the same surface was seen (VCT Section
// 4.3): the last pass of PixelCones::update(), which a test compares.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_pixels.glsl"

layout(binding = RELUME_CONE_UNIT_LIGHT) uniform sampler2D now;
layout(binding = RELUME_CONE_UNIT_OLD_LIGHT) uniform sampler2D oldLight;
layout(binding = RELUME_CONE_UNIT_OLD_PLACES) uniform sampler2D oldPlaces;
layout(binding = RELUME_CONE_UNIT_OLD_PLANES) uniform sampler2D oldPlanes;
layout(binding = RELUME_CONE_UNIT_OLD_FRAMES) uniform sampler2D oldFrames;
layout(rgba32f, binding = 0) writeonly uniform image2D light;
layout(r32f, binding = 1) writeonly uniform image2D frames;

uniform mat4 relumeConeOldClip;  // from the world
uniform float relumeConeRowsUp;  // 1 = row 0 is at the bottom, -1 = on top
uniform float relumeConeMost;    // frames
uniform uint relumeConeHasBefore;

const int kReach = RELUME_CONE_PATTERN / 2;

// Light and how many frames it is the mean of, bilinear over the pixels that saw the surface; 0 frames = nothing.
float before(RelumePixel here, out vec4 found) {
  found = vec4(0.0);
  vec4 clip = relumeConeOldClip * vec4(here.position, 1.0);
  if (relumeConeHasBefore == 0u || !(clip.w > 0.0)) return 0.0;
  vec2 p = (0.5 + 0.5 * vec2(1.0, relumeConeRowsUp) * clip.xy / clip.w) * vec2(relumeConePicture) - 0.5;
  if (!(all(greaterThan(p, vec2(-1.0))) && all(lessThan(p, vec2(relumeConePicture))))) return 0.0;
  vec2 low = floor(p), f = p - low;
  float share = 0.0, count = 0.0;
  for (int k = 0; k < 4; ++k) {
    ivec2 q = ivec2(low) + ivec2(k & 1, k >> 1);
    if (!relumeHolds(q)) continue;
    vec4 place = texelFetch(oldPlaces, q, 0);
    if (!relumeIsSame(here, RelumePixel(place.xyz, place.w, texelFetch(oldPlanes, q, 0).xyz))) continue;
    float w = ((k & 1) != 0 ? f.x : 1.0 - f.x) * ((k >> 1) != 0 ? f.y : 1.0 - f.y);
    found += w * texelFetch(oldLight, q, 0);
    count += w * texelFetch(oldFrames, q, 0).r;
    share += w;
  }
  if (!(share > 1e-3)) return 0.0;
  found /= share;
  return count / share;
}

void main() {
  uint thread = relumeLiveThread();
  if (thread >= relumeLiveThreads) return;
  ivec2 at = relumePixelOf(thread);
  RelumePixel here = relumePixelAt(at);
  vec4 found = texelFetch(now, at, 0), old = vec4(0.0);
  float weight = 1.0, count = here.depth > 0.0 ? before(here, old) : 0.0;
  if (count > 0.0) {
    // No brighter nor darker than what is around, and a quarter more.
    vec4 low = found, high = found;
    for (int j = -kReach; j <= kReach; ++j) {
      for (int i = -kReach; i <= kReach; ++i) {
        ivec2 there = at + ivec2(i, j);
        if (!relumeHolds(there) || !relumeIsSame(here, relumePixelAt(there))) continue;
        vec4 other = texelFetch(now, there, 0);
        low = min(low, other);
        high = max(high, other);
      }
    }
    found = (count * clamp(old, 0.75 * low, 1.25 * high) + found) / (count + 1.0);
    weight = min(count + 1.0, relumeConeMost);
  }
  imageStore(light, at, found);
  imageStore(frames, at, vec4(weight));
}
