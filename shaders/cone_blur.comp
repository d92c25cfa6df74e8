// SPDX-License-Identifier: MIT
// A blur along one axis within a surface, the inner pixels each, the outer ones by pairs (VCT Section 4.2): a pass of
// PixelCones::update(), which a test compares. A work group has a strip of pixels along the axis.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/cone_pixels.glsl"

layout(binding = RELUME_CONE_UNIT_LIGHT) uniform sampler2D from;
layout(rgba32f, binding = 0) writeonly uniform image2D light;

uniform ivec2 relumeConeAlong;

const int kRadius = 8;     // [pixels]
const float kSigma = 4.0;  // [pixels]

ivec2 own;  // this thread's pixel
ivec2 placeAt(int i) { return own + i * relumeConeAlong; }

ivec2 ownPixel() {
  ivec2 across = ivec2(1) - relumeConeAlong;
  int length_ = relumeConePicture.x * relumeConeAlong.x + relumeConePicture.y * relumeConeAlong.y;
  uint strips = uint(length_ + RELUME_LIVE_GROUP - 1) / uint(RELUME_LIVE_GROUP);
  uint strip = relumeLiveThread() / uint(RELUME_LIVE_GROUP);
  int first = int(strip % strips) * RELUME_LIVE_GROUP;
  return (first + int(gl_LocalInvocationIndex)) * relumeConeAlong + int(strip / strips) * across;
}

#if RELUME_CONE_SHARES
// Threads of hardware read their strip together; software has one for all of them anyway.
shared vec4 stripPlace[RELUME_LIVE_GROUP + 2 * kRadius], stripLight[RELUME_LIVE_GROUP + 2 * kRadius];
shared vec3 stripPlane[RELUME_LIVE_GROUP + 2 * kRadius];

void readStrip(int i) {
  ivec2 at = placeAt(i);
  if (!relumeHolds(at)) return;
  int k = int(gl_LocalInvocationIndex) + kRadius + i;
  RelumePixel pixel = relumePixelAt(at);
  stripPlace[k] = vec4(pixel.position, pixel.depth);
  stripPlane[k] = pixel.plane;
  stripLight[k] = texelFetch(from, at, 0);
}

RelumePixel pixelOf(int i) {
  int k = int(gl_LocalInvocationIndex) + kRadius + i;
  return RelumePixel(stripPlace[k].xyz, stripPlace[k].w, stripPlane[k]);
}

vec4 lightOf(int i) { return stripLight[int(gl_LocalInvocationIndex) + kRadius + i]; }
#else
RelumePixel pixelOf(int i) { return relumePixelAt(placeAt(i)); }
vec4 lightOf(int i) { return texelFetch(from, placeAt(i), 0); }
#endif

void main() {
  own = ownPixel();
#if RELUME_CONE_SHARES
  readStrip(0);
  if (int(gl_LocalInvocationIndex) < kRadius) readStrip(-kRadius);
  if (int(gl_LocalInvocationIndex) >= RELUME_LIVE_GROUP - kRadius) readStrip(kRadius);
  barrier();
#endif
  if (relumeLiveThread() >= relumeLiveThreads || !relumeHolds(own)) return;
  RelumePixel here = pixelOf(0);
  if (here.depth == 0.0) {
    imageStore(light, own, vec4(0.0));
    return;
  }
  vec4 sum = lightOf(0);
  float weights = 1.0;
  for (int i = 1; i <= kRadius; ++i) {
    float middle = i <= kRadius / 2 ? float(i) : float(i - 1 | 1) + 0.5;
    float weight = exp(-middle * middle / (2.0 * kSigma * kSigma));
    for (int side = -1; side <= 1; side += 2) {
      if (!relumeHolds(placeAt(side * i)) || !relumeIsSame(here, pixelOf(side * i))) continue;
      sum += weight * lightOf(side * i);
      weights += weight;
    }
  }
  imageStore(light, own, sum / weights);
}
