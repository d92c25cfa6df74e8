// SPDX-License-Identifier: MIT
// Whether a pixel and one to its right, below it or both lie on different surfaces (VCT Section 4.2): the second pass
// of PixelCones::update(), which a test compares.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_pixels.glsl"

layout(r8ui, binding = 0) writeonly uniform uimage2D edges;

void main() {
  uint thread = relumeLiveThread();
  if (thread >= relumeLiveThreads) return;
  ivec2 at = relumePixelOf(thread);
  RelumePixel here = relumePixelAt(at);
  uint edge = 0u;
  for (int k = 1; k < 4; ++k) {
    ivec2 there = at + ivec2(k & 1, k >> 1);
    if (relumeHolds(there) && !relumeIsSame(here, relumePixelAt(there))) edge = 1u;
  }
  imageStore(edges, at, uvec4(edge));
}
