// SPDX-License-Identifier: MIT
// Take over what a camera sees from textures of the host's. What is out of range or not finite is not seen.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_pixels.glsl"

layout(rgba32f, binding = 0) writeonly uniform image2D places;
layout(rgba32f, binding = 1) writeonly uniform image2D planes;

// By bits: drivers may take comparisons with what is no number either way.
bool isWithin(vec3 v, float most) {
  uvec3 exponent = floatBitsToUint(v) & 0x7F800000u;
  return all(notEqual(exponent, uvec3(0x7F800000u))) && all(lessThanEqual(abs(v), vec3(most)));
}

void main() {
  uint i = relumeLiveThread();
  if (i >= relumeLiveThreads) return;
  ivec2 at = relumePixelOf(i);
  RelumePixel pixel = relumePixelAt(at);
  bool isSeen = pixel.depth > 0.0 && isWithin(vec3(pixel.depth), RELUME_MAX_COORDINATE) &&
                isWithin(pixel.position, RELUME_MAX_COORDINATE) && isWithin(pixel.plane, 2.0);
  imageStore(places, at, isSeen ? vec4(pixel.position, pixel.depth) : vec4(0.0));
  imageStore(planes, at, isSeen ? vec4(pixel.plane, 0.0) : vec4(0.0));
}
