// SPDX-License-Identifier: MIT
// The mean over the pattern around a pixel, of its own surface (VCT Section 4.2): the third pass of
// PixelCones::update(), which a test compares.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_pixels.glsl"

layout(binding = RELUME_CONE_UNIT_LIGHT) uniform sampler2D traced;
layout(binding = RELUME_CONE_UNIT_EDGES) uniform usampler2D edges;
layout(rgba32f, binding = 0) writeonly uniform image2D light;

const int kReach = RELUME_CONE_PATTERN / 2;

void main() {
  uint thread = relumeLiveThread();
  if (thread >= relumeLiveThreads) return;
  ivec2 at = relumePixelOf(thread);
  RelumePixel here = relumePixelAt(at);
  if (here.depth == 0.0) {
    imageStore(light, at, vec4(0.0));
    return;
  }
  bool plain = relumeHolds(at - kReach) && relumeHolds(at + kReach);
  for (int j = -kReach; j <= kReach && plain; ++j) {
    for (int i = -kReach; i <= kReach && plain; ++i) plain = texelFetch(edges, at + ivec2(i, j), 0).r == 0u;
  }
  vec4 sum = vec4(0.0);
  float count = 0.0;
  for (int j = -kReach; j <= kReach; ++j) {
    for (int i = -kReach; i <= kReach; ++i) {
      ivec2 there = at + ivec2(i, j);
      if (!plain && !(relumeHolds(there) && relumeIsSame(here, relumePixelAt(there)))) continue;
      sum += texelFetch(traced, there, 0);
      count += 1.0;
    }
  }
  imageStore(light, at, sum / count);
}
