// SPDX-License-Identifier: MIT
// What surfaces mirror: seven cones of the lobe about each pixel's mirrored direction, ConeTracer::glossy(), which a
// test compares.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/live_volume.glsl"
#include "lib/cone_depth.glsl"
#include "lib/cone_voxels.glsl"
#include "lib/cone_sky.glsl"
#include "lib/cone_trace.glsl"
#include "lib/cone_pixels.glsl"

layout(binding = RELUME_CONE_UNIT_NORMALS) uniform sampler2D mirrored;  // direction; exponent, negative = none
layout(rgba32f, binding = 0) writeonly uniform image2D light;

const uint kCones = 7u;

// A cone of the lobe cos^exponent about +z, and the tangent of its half angle: lobeCones(), runtime/cones/cone_light.h
vec4 coneOfLobe(uint i, float exponent) {
  float rest = (float(i) + 0.5) / float(kCones), share = 1.0 - rest;
  // The direction's cosine is share^(1 / (exponent + 1)); 1 - cosine² and 1 - cosine of the half angle keep their
  // precision where lobes are narrow.
  float x = relumeDepthOfOpacity(rest) / (exponent + 1.0), z = exp(-x), r = sqrt(relumeBlocked(2.0 * x));
  float cap = min(1.0 / ((exponent + 1.0) * pow(share, exponent / (exponent + 1.0)) * float(kCones)), 0.9);
  float angle = 2.399963230 * float(i);
  return vec4(r * cos(angle), r * sin(angle), z, sqrt(cap * (2.0 - cap)) / (1.0 - cap));
}

// The frame about a reflected direction that turns with the plane that reflects.
mat3 frameOver(vec3 normal, vec3 reflected) {
  vec3 up = normal - dot(normal, reflected) * reflected;
  float length2 = dot(up, up);
  if (!(length2 > 1e-6)) return relumeFrameAbout(reflected);
  vec3 t = up / sqrt(length2);
  return mat3(t, cross(reflected, t), reflected);
}

void main() {
  uint thread = relumeLiveThread();
  if (thread >= relumeLiveThreads) return;
  ivec2 at = relumePixelOf(thread);
  RelumePixel pixel = relumePixelAt(at);
  vec4 mirror = texelFetch(mirrored, at, 0);
  vec3 sum = vec3(0.0);
  float count = 0.0;
  if (pixel.depth > 0.0 && mirror.w >= 0.0 && relumeConeIsUnit(mirror.xyz)) {
    vec3 origin = relumeConeOrigin(pixel.position);
    mat3 frame = frameOver(pixel.plane, mirror.xyz);
    float exponent = min(mirror.w, RELUME_MAX_EXPONENT);
    for (uint i = 0u; i < kCones; ++i) {
      vec4 cone = coneOfLobe(i, exponent);
      vec3 direction = frame * cone.xyz;
      if (dot(direction, pixel.plane) <= 0.0) continue;
      sum += relumeConeFollow(RelumeCone(origin, pixel.plane, direction, cone.w), 0.0).rgb;
      count += 1.0;
    }
  }
  imageStore(light, at, vec4(count > 0.0 ? sum / count : vec3(0.0), 0.0));
}
