// SPDX-License-Identifier: MIT
// Take over what a camera sees from textures of the host's. What is out of range or not finite is not seen.
#include "shared/layout.h"
#include "lib/is_within.glsl"
#include "lib/live_threads.glsl"
#include "lib/cone_pixels.glsl"

layout(rgba32f, binding = 0) writeonly uniform image2D places;
layout(rgba32f, binding = 1) writeonly uniform image2D planes;

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  ivec2 at = relumePixelOf(i);
  RelumePixel pixel = relumePixelAt(at);
  bool isSeen = pixel.depth > 0.0 && relumeIsWithin(vec3(pixel.depth), RELUME_MAX_COORDINATE) &&
                relumeIsWithin(pixel.position, RELUME_MAX_COORDINATE) && relumeIsWithin(pixel.plane, 2.0);
  imageStore(places, at, isSeen ? vec4(pixel.position, pixel.depth) : vec4(0.0));
  imageStore(planes, at, isSeen ? vec4(pixel.plane, 0.0) : vec4(0.0));
}
