// SPDX-License-Identifier: MIT
// A blur along one axis within a surface, the inner pixels each, the outer ones by pairs (VCT Section 4.2): a pass of
// PixelCones::update(), which a test compares.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_pixels.glsl"

layout(binding = RELUME_CONE_UNIT_LIGHT) uniform sampler2D from;
layout(rgba32f, binding = 0) writeonly uniform image2D light;

uniform ivec2 relumeConeAlong;

const int kRadius = 8;     // [pixels]
const float kSigma = 4.0;  // [pixels]

void main() {
  uint thread = relumeLiveThread();
  if (thread >= relumeLiveThreads) return;
  ivec2 at = relumePixelOf(thread);
  RelumePixel here = relumePixelAt(at);
  if (here.depth == 0.0) {
    imageStore(light, at, vec4(0.0));
    return;
  }
  vec4 sum = texelFetch(from, at, 0);
  float weights = 1.0;
  for (int i = 1; i <= kRadius; ++i) {
    float middle = i <= kRadius / 2 ? float(i) : float(i - 1 | 1) + 0.5;
    float weight = exp(-middle * middle / (2.0 * kSigma * kSigma));
    for (int side = -1; side <= 1; side += 2) {
      ivec2 there = at + side * i * relumeConeAlong;
      if (!relumeHolds(there) || !relumeIsSame(here, relumePixelAt(there))) continue;
      sum += weight * texelFetch(from, there, 0);
      weights += weight;
    }
  }
  imageStore(light, at, sum / weights);
}
