// SPDX-License-Identifier: MIT
// Cones through the levels: RadianceMips::trace() (runtime/cones/radiance_mips.h), which a test compares.
//
// Level 0 is read corner by corner, as its voxels have sides. Further levels are read by the filter of textures:
// directions lie beside each other along x, levels but the first behind each other along z, so places are clamped to
// their own block, and what a block's border texel lacks of a whole weight lies outside of the volume, where all is
// empty. Hardware filters by weights of 8 bits, software by floats.
#include "lib/cone_unit.glsl"

layout(binding = RELUME_CONE_UNIT_FIRST) uniform sampler3D relumeConeFirst;
layout(binding = RELUME_CONE_UNIT_LEVELS) uniform sampler3D relumeConeLevels;
#ifdef RELUME_LIVE_NESTED
#include "lib/cone_volumes.glsl"
#else
uniform uint relumeConeLevelCount;  // above the voxels
uniform uint relumeConeOffset[RELUME_CONE_MAX_LEVELS];  // of each level along z

float relumeConeAlongZ(int level) { return float(relumeConeOffset[level]); }
// Where a cone begins. [m; voxels]
vec3 relumeConeOrigin(vec3 world) { return (world - relumeLiveOrigin) / relumeLiveVoxel; }
#endif

const float kConeSpent = 0.01;  // a cone ends where no more of it is clear
const float kConeClear = 1.75;  // [voxels] above its own plane a cone begins
const float kConePlane = 2.5;   // [sample widths] least height above the cone's own plane
const float kConeNear = 3.0;    // [voxels] from its start a cone may be in the voxels of walls beside it
const float kConeStep = 0.5;    // [sample widths]
const float kConeFarthest = 524288.0;  // [voxels] before the grid from which on a cone finds nothing

struct RelumeCone {
  vec3 origin;     // relumeConeOrigin()
  vec3 normal;     // unit
  vec3 direction;  // unit
  float spread;    // tangent of the half angle
};

// isNear: what the cone starts behind does not block it.
vec4 relumeConeReadVoxels(vec3 place, vec3 way, bool isNear, vec3 origin) {
  vec3 p = place - 0.5, low = floor(p), f = p - low;
  vec4 sum = vec4(0.0);
  uvec4 cell;
  ivec3 cellAt = ivec3(-1);  // mostly all corners lie in one
  for (int i = 0; i < 8; ++i) {
    ivec3 at = ivec3(i & 1, i >> 1 & 1, i >> 2), v = ivec3(low) + at;
    if (!relumeLiveHolds(v)) continue;
    if (v >> 2 != cellAt) {
      cellAt = v >> 2;
      cell = relumeLiveCell(cellAt);
    }
    uint bit = relumeLiveBit(v);
    if (!relumeLiveIsSet(cell.xy, bit)) continue;
    uint number = cell.z + relumeLiveCountBefore(cell.xy, bit);
    if (isNear && relumeConeIsBehind(number, way, origin)) continue;
    vec3 w = mix(1.0 - f, f, equal(at, ivec3(1)));
    sum += w.x * w.y * w.z * relumeConeVoxel(number, way);
  }
  return sum;
}

// A block of one level: where a place lies in it, and how much of a whole weight its texels have.
float relumeConeBlock(int level, vec3 place, out vec3 at, out float width) {
  vec3 size = vec3((4 * ivec3(relumeLiveSize) + (1 << level) - 1) >> level), p = place / float(1 << level);
  vec3 inside = clamp(p + 0.5, 0.0, 1.0) * clamp(size + 0.5 - p, 0.0, 1.0);
  at = clamp(p, vec3(0.5), size - 0.5);
  width = size.x;
  return inside.x * inside.y * inside.z;
}

#if RELUME_CONE_DIRECTIONS == 1
#define RELUME_CONE_SAMPLE(levels, at, way, width) textureLod(levels, (at) / vec3(textureSize(levels, 0)), 0.0)
#else
// Three of six directions, by the squares of the ray's.
#define RELUME_CONE_ALONG(levels, at, way, width, a)                                        \
  way[a] * way[a] *                                                                         \
      textureLod(levels, ((at) + vec3((way[a] < 0.0 ? 2 * a + 1 : 2 * a) * width, 0, 0)) / \
                             vec3(textureSize(levels, 0)), 0.0)
#define RELUME_CONE_SAMPLE(levels, at, way, width)                                              \
  RELUME_CONE_ALONG(levels, at, way, width, 0) + RELUME_CONE_ALONG(levels, at, way, width, 1) + \
      RELUME_CONE_ALONG(levels, at, way, width, 2)
#endif

vec4 relumeConeReadFirst(vec3 place, vec3 way) {
  vec3 at;
  float width, weight = relumeConeBlock(1, place, at, width);
#ifdef RELUME_LIVE_NESTED
  at.z += relumeConeAlongZ(1);
#endif
  return weight * vec4(vec3(relumeConeUnit()), 1.0) * (RELUME_CONE_SAMPLE(relumeConeFirst, at, way, width));
}

// [level >= 2]
vec4 relumeConeReadFurther(int level, vec3 place, vec3 way) {
  vec3 at;
  float width, weight = relumeConeBlock(level, place, at, width);
  at.z += relumeConeAlongZ(level);
  return weight * vec4(vec3(relumeConeUnit()), 1.0) * (RELUME_CONE_SAMPLE(relumeConeLevels, at, way, width));
}

// By its bits, as drivers may take comparisons with what is no number either way.
bool relumeConeIsUnit(vec3 v) {
  uint square = floatBitsToUint(dot(v, v));
  return square > floatBitsToUint(0.99) && square < floatBitsToUint(1.01);
}

// Where along a ray the grid lies, a voxel more on all sides; end <= begin where it does not, or too far away. [voxels]
void relumeConeClip(vec3 origin, vec3 way, out float begin, out float end) {
  begin = 0.0;
  end = 1e30;
  for (int k = 0; k < 3; ++k) {
    float d = way[k], low = -1.0 - origin[k], high = float(4u * relumeLiveSize[k]) + 1.0 - origin[k];
    if (abs(d) < 1e-9) {
      if (low > 0.0 || high < 0.0) end = begin;
      continue;
    }
    float a = low / d, b = high / d;
    begin = max(begin, min(a, b));
    end = min(end, max(a, b));
  }
  if (begin >= kConeFarthest) end = begin;
}

#ifdef RELUME_LIVE_NESTED
#include "lib/cone_nested.glsl"
#else
// How far a cone has come. [voxels]
struct RelumeMarch {
  float t, end;
  float width, advance, middle;  // of the sample at t
  vec3 place;
  vec3 radiance;
  float clear, occlusion;
};

bool relumeConeIsOn(RelumeMarch m) { return m.t < m.end && m.clear > kConeSpent; }

// The sample at t.
void relumeConeSample(RelumeCone cone, float cosine, inout RelumeMarch m) {
  m.width = clamp(m.t * min(cone.spread, cosine / kConePlane), 1.0, float(1u << relumeConeLevelCount));
  m.advance = min(kConeStep * m.width, m.end - m.t);
  m.middle = m.t + 0.5 * m.advance;
  // Until the cone is clear of the voxels of its own surface it slides along that.
  m.place = cone.origin + m.middle * cone.direction + max(0.0, kConeClear - m.middle * cosine) * cone.normal;
}

// The next one.
void relumeConeAdvance(RelumeCone cone, float cosine, inout RelumeMarch m) {
  m.t += kConeStep * m.width;
  relumeConeSample(cone, cosine, m);
}

// What the sample reads blocks the cone.
void relumeConeMeets(vec4 depth, float falloff, inout RelumeMarch m) {
  if (!(depth.w > 0.0)) return;
  float blocked = m.clear * relumeBlocked(depth.w * m.advance / m.width);
  m.radiance += (blocked / depth.w) * depth.rgb;
  m.occlusion += blocked / (1.0 + falloff * m.middle * relumeLiveVoxel);
  m.clear -= blocked;
}

// Radiance with what lies beyond the volume, and occlusion. Samples widen, so each range of widths has a loop of its
// own that reads no more than it needs: software executes both branches of a condition.
vec4 relumeConeFollow(RelumeCone cone, float falloff) {
  vec3 way = cone.direction;
  if (!relumeConeIsUnit(cone.normal) || !relumeConeIsUnit(way)) return vec4(relumeSkyAlong(way), 0.0);
  float cosine = dot(way, cone.normal);
  RelumeMarch m;
  relumeConeClip(cone.origin, way, m.t, m.end);
  m.radiance = vec3(0.0);
  m.clear = 1.0;
  m.occlusion = 0.0;
  relumeConeSample(cone, cosine, m);

  // Beside its own walls
  while (relumeConeIsOn(m) && m.middle < kConeNear) {
    vec4 depth = relumeConeReadVoxels(m.place, way, true, cone.origin);
    if (m.width > 1.0) depth = mix(depth, relumeConeReadFirst(m.place, way), log2(m.width));
    relumeConeMeets(depth, falloff, m);
    relumeConeAdvance(cone, cosine, m);
  }
  // Voxels, and level 1
  while (relumeConeIsOn(m) && m.width < 2.0) {
    vec4 first = relumeConeReadFirst(m.place, way), depth = vec4(0.0);
    // What the filter reads of level 1 holds all voxels that are read here.
    if (first.w > 0.0) depth = mix(relumeConeReadVoxels(m.place, way, false, cone.origin), first, log2(m.width));
    relumeConeMeets(depth, falloff, m);
    relumeConeAdvance(cone, cosine, m);
  }
  // Levels 1 and 2
  while (relumeConeIsOn(m) && m.width < 4.0) {
    vec4 depth = mix(relumeConeReadFirst(m.place, way), relumeConeReadFurther(2, m.place, way), log2(m.width) - 1.0);
    relumeConeMeets(depth, falloff, m);
    relumeConeAdvance(cone, cosine, m);
  }
  // Further levels
  while (relumeConeIsOn(m)) {
    float level = clamp(log2(m.width), 2.0, float(relumeConeLevelCount));
    int below = int(level);
    vec4 depth = mix(relumeConeReadFurther(below, m.place, way),
                     relumeConeReadFurther(min(below + 1, int(relumeConeLevelCount)), m.place, way),
                     level - float(below));
    relumeConeMeets(depth, falloff, m);
    relumeConeAdvance(cone, cosine, m);
  }

  if (m.clear <= kConeSpent) return vec4(m.radiance, m.occlusion) / (1.0 - m.clear);
  return vec4(m.radiance + m.clear * relumeSkyAlong(way), m.occlusion);
}
#endif

// Two directions across a unit vector (formats/frame_about.h).
mat3 relumeFrameAbout(vec3 n) {
  float side = floatBitsToInt(n.z) < 0 ? -1.0 : 1.0, a = -1.0 / (side + n.z), b = n.x * n.y * a;
  return mat3(vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x), vec3(b, side + n.y * n.y * a, -n.y), n);
}
