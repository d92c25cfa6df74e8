// SPDX-License-Identifier: MIT
// Surfaces that pixels see, and which of them are one: runtime/cones/pixel_cones.cpp.
layout(binding = RELUME_CONE_UNIT_PLACES) uniform sampler2D relumeConePlaces;
layout(binding = RELUME_CONE_UNIT_PLANES) uniform sampler2D relumeConePlanes;
uniform ivec2 relumeConePicture;  // [pixels]

struct RelumePixel {
  vec3 position;  // [m]
  float depth;    // [m] 0 = nothing is seen
  vec3 plane;
};

RelumePixel relumePixelAt(ivec2 at) {
  vec4 place = texelFetch(relumeConePlaces, at, 0);
  return RelumePixel(place.xyz, place.w, texelFetch(relumeConePlanes, at, 0).xyz);
}

// Whether their normals agree, and each lies in the plane of the other.
bool relumeIsSame(RelumePixel a, RelumePixel b) {
  if (a.depth == 0.0 || b.depth == 0.0) return a.depth == b.depth;
  vec3 across = b.position - a.position;
  float most = 0.02 * min(a.depth, b.depth);
  return dot(a.plane, b.plane) >= 0.9 && abs(dot(across, a.plane)) <= most && abs(dot(across, b.plane)) <= most;
}

bool relumeHolds(ivec2 at) { return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, relumeConePicture)); }

ivec2 relumePixelOf(uint thread) {
  return ivec2(thread % uint(relumeConePicture.x), thread / uint(relumeConePicture.x));
}
