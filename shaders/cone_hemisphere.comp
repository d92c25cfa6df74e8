// SPDX-License-Identifier: MIT
// Light from the hemisphere over each pixel, by one of its cones or by all: the first pass of PixelCones::update(),
// which a test compares. Threads that run beside each other follow the same cone, of pixels a pattern apart.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/live_volume.glsl"
#include "lib/cone_depth.glsl"
#include "lib/cone_voxels.glsl"
#include "lib/cone_sky.glsl"
#if RELUME_CONE_HALVES  // hardware; lobes, whose cones lie closer together, gain nothing by it
#define RELUME_CONE_ONE_LOOP
#endif
#include "lib/cone_trace.glsl"
#include "lib/cone_pixels.glsl"

layout(binding = RELUME_CONE_UNIT_NORMALS) uniform sampler2D normals;
layout(rgba32f, binding = 0) writeonly uniform image2D light;

uniform uint relumeConeAll;       // cones that each pixel follows; 0 = one of the pattern
uniform vec2 relumeConeTurn;      // cosine and sine
uniform float relumeConeFalloff;  // [1/m]

vec4 alongCone(uint which, RelumePixel pixel, mat3 frame) {
  vec4 cone = coneDirection[which];
  vec3 direction = frame * cone.xyz;
  // Below the plane there is the surface itself.
  if (dot(direction, pixel.plane) <= 0.0) return vec4(0.0, 0.0, 0.0, 1.0);
  return relumeConeFollow(RelumeCone(relumeConeOrigin(pixel.position), pixel.plane, direction, cone.w), relumeConeFalloff);
}

void main() {
  uint thread = relumeLiveThread(), which = 0u;
  if (thread >= relumeLiveThreads) return;
  ivec2 at;
  if (relumeConeAll == 0u) {
    uvec2 blocks = (uvec2(relumeConePicture) + uint(RELUME_CONE_PATTERN - 1)) / uint(RELUME_CONE_PATTERN);
    which = thread / (blocks.x * blocks.y);
    uint block = thread % (blocks.x * blocks.y);
    at = RELUME_CONE_PATTERN * ivec2(block % blocks.x, block / blocks.x) +
         ivec2(which % uint(RELUME_CONE_PATTERN), which / uint(RELUME_CONE_PATTERN));
    if (!relumeHolds(at)) return;
  } else {
    at = relumePixelOf(thread);
  }
  RelumePixel pixel = relumePixelAt(at);
  vec4 sum = vec4(0.0);
  vec3 normal = texelFetch(normals, at, 0).xyz;
  if (pixel.depth > 0.0 && relumeConeIsUnit(normal)) {
    mat3 f = relumeFrameAbout(normal);
    mat3 frame = mat3(relumeConeTurn.x * f[0] + relumeConeTurn.y * f[1],
                      relumeConeTurn.x * f[1] - relumeConeTurn.y * f[0], f[2]);
    if (relumeConeAll == 0u) {
      sum = alongCone(which, pixel, frame);
    } else {
      for (uint k = 0u; k < relumeConeAll; ++k) sum += alongCone(k, pixel, frame) / float(relumeConeAll);
    }
  }
  imageStore(light, at, sum);
}
