// SPDX-License-Identifier: MIT
// All caches of a volume gather what their rays meet there: LiveCaches::gather(), which a test compares. Rays are the
// same for all caches. RELUME_LANES threads share a cache. RELUME_LIVE_NESTED: rays that leave the volume go on in the
// one that it lies in.
#include "shared/layout.h"
#include "lib/live_threads.glsl"
#include "lib/live_volume.glsl"
#include "lib/live_sub_voxels.glsl"
#define RELUME_SH_BANDS 3
#include "lib/sh.glsl"

layout(binding = RELUME_LIVE_UNIT_MOVING) uniform usampler3D relumeLiveMovingCells;  // bits in x and y; first number
layout(binding = RELUME_LIVE_UNIT_RAYS) uniform sampler2D relumeLiveRays;         // directions; the sky along them
layout(binding = RELUME_LIVE_UNIT_RADIANCE) uniform sampler2D relumeLiveRadiance;  // of live_reflect.comp
layout(rgba32f, binding = 0) uniform image2D lightImage;
layout(std430, binding = RELUME_LIVE_SLOT_CACHES) readonly buffer Caches { uint cacheVoxel[]; };
layout(std430, binding = RELUME_LIVE_SLOT_RAY_CELLS) readonly buffer RayCells { RelumeRayCell rayCells[]; };
layout(std430, binding = RELUME_LIVE_SLOT_SUB_VOXELS) readonly buffer SubVoxels { uvec2 subVoxels[]; };

uniform uint relumeLiveRayCount;
uniform uint relumeLiveFirstCache;
uniform uvec2 relumeLiveRow;   // cells of relumeLiveCells in x and in y
uniform uint relumeLiveEmits;  // 0 = nothing emits
uniform float relumeLiveKeep;  // share of what a cache has that stays
#ifdef RELUME_LIVE_NESTED
// The volumes, from the outermost on, and which one's caches gather; what is below is of the one that a ray is in.
uniform uint relumeLiveVolume;
uniform uvec3 relumeLiveSizes[RELUME_LIVE_MAX_VOLUMES];
uniform uint relumeLiveLayers[RELUME_LIVE_MAX_VOLUMES];
uniform uint relumeLiveMoving[RELUME_LIVE_MAX_VOLUMES];
uniform uvec2 relumeLiveEnds[RELUME_LIVE_MAX_VOLUMES];
uniform vec3 relumeLiveToOuter[RELUME_LIVE_MAX_VOLUMES];  // [voxels of the outer one] where it begins there
uint relumeLiveMoves;
uvec2 relumeLiveEnd;
#else
uniform uint relumeLiveMoves;  // 0 = nothing moves
uniform uvec2 relumeLiveEnd;   // numbers of voxels with sides: of those that stand, and of all
#endif

#if RELUME_LANES > 1
shared vec4 part[RELUME_LIVE_GROUP * 7];
#endif

uvec4 movingCell(ivec3 cell) { return texelFetch(relumeLiveMovingCells, cell + ivec3(0, 0, relumeLiveLayer), 0); }

uint rayCellIndex(ivec3 cell) {
  return (uint(cell.z + relumeLiveLayer) * relumeLiveRow.y + uint(cell.y)) * relumeLiveRow.x + uint(cell.x);
}

uvec2 subVoxelsOf(uvec2 bits, uint first, uint bit) {
  return relumeLiveIsSet(bits, bit) ? subVoxels[first + relumeLiveCountBefore(bits, bit)] : uvec2(0u);
}

uvec2 movingSubVoxels(uint cell, uint bit) {
  return subVoxelsOf(rayCells[cell].moving, rayCells[cell].firstMoving, bit);
}

// The bits of a brick or of a voxel's sub-voxels.
uvec2 rayBrick(ivec3 cell) {
  uint index = rayCellIndex(cell);
  uvec2 bits = rayCells[index].standing;
  return relumeLiveMoves != 0u ? bits | rayCells[index].moving : bits;
}
uvec2 subVoxelsIn(ivec3 v) {
  uint index = rayCellIndex(v >> 2), bit = relumeLiveBit(v);
  uvec2 found = subVoxelsOf(rayCells[index].standing, rayCells[index].firstStanding, bit);
  return relumeLiveMoves != 0u ? found | movingSubVoxels(index, bit) : found;
}

// Where the ray is along an axis when it leaves a brick along another at t: a guess, then as many crossings as come
// before. Of crossings at one t those of the first axis come first.
int whenLeaving(relumeLiveRay ray, vec3 way, int axis, int v, float t, int across) {
  int along = ray.along[axis], ahead = ray.ahead[axis];
  if (along == 0) return v;
  int low = v & ~3, last = along > 0 ? low + 3 : low;
  int at = clamp(int(ray.origin[axis] + t * way[axis]), min(v, last), max(v, last));
  for (int i = 0; i < 3 && at != last; ++i) {
    float cross = (float(at + ahead) - ray.origin[axis]) * ray.inverse[axis];
    if (!(cross < t || (cross == t && axis < across))) break;
    at += along;
  }
  for (int i = 0; i < 3 && at != v; ++i) {
    float cross = (float(at - along + ahead) - ray.origin[axis]) * ray.inverse[axis];
    if (cross < t || (cross == t && axis < across)) break;
    at -= along;
  }
  return at;
}

// The first voxel with a sub-voxel in the ray's way, from inside of the grid (runtime/voxels/march.h); false = none.
// sub: its bit; across: a plane of which axis the ray came into it, -1 = it begins there.
bool march(vec3 origin, vec3 way, out ivec3 v, out uint sub, out int across) {
  relumeLiveRay ray = relumeLiveRayOf(origin, way);
  ivec3 cell = ivec3(-1);
  uvec2 brick = uvec2(0u);
  int entered = -1;  // across a plane of which axis the ray came into the voxel
  float since = 0.0;
  v = ivec3(floor(origin));
  sub = 0u;
  across = -1;
  while (relumeLiveHolds(v)) {
    if ((v >> 2) != cell) {
      cell = v >> 2;
      brick = rayBrick(cell);
    }
    if (brick == uvec2(0u)) {
      ivec3 low = v & ~3;
      vec3 t = relumeLiveCrossings(ray, low + 3 * ray.ahead, 1.0);
      entered = relumeLiveFirstAxis(t);
      since = t[entered];
      if (since >= 1e30) return false;
      ivec3 at;
      for (int a = 0; a < 3; ++a) at[a] = whenLeaving(ray, way, a, v[a], since, entered);
      at[entered] = ray.along[entered] > 0 ? low[entered] + 4 : low[entered] - 1;
      v = at;
    } else {
      if (relumeLiveIsSet(brick, relumeLiveBit(v)) &&
          relumeLiveMeets(ray, v, subVoxelsIn(v), entered, since, 1e30, sub, across))
        return true;
      vec3 t = relumeLiveCrossings(ray, v, 1.0);
      entered = relumeLiveFirstAxis(t);
      since = t[entered];
      if (since >= 1e30) return false;
      v[entered] += ray.along[entered];
    }
  }
  return false;
}

ivec2 sideAt(uint side) {
  return ivec2(side % uint(RELUME_LIVE_SIDES_A_ROW), side / uint(RELUME_LIVE_SIDES_A_ROW));
}

// The number of a layer's voxel; kRelumeLiveNone where it is not occupied.
uint numberOf(uvec4 cell, uint bit) {
  return relumeLiveIsSet(cell.xy, bit) ? cell.z + relumeLiveCountBefore(cell.xy, bit) : kRelumeLiveNone;
}
uint numberAt(bool moves, ivec3 v) {
  return numberOf(moves ? movingCell(v >> 2) : relumeLiveCell(v >> 2), relumeLiveBit(v));
}

bool isOccupied(ivec3 v) {
  if (!relumeLiveHolds(v)) return false;
  uvec2 bits = relumeLiveCell(v >> 2).xy;
  if (relumeLiveMoves != 0u) bits |= movingCell(v >> 2).xy;
  return relumeLiveIsSet(bits, relumeLiveBit(v));
}

// This and what follows as in runtime/voxels/radiance_along.h
bool isBehindOthers(ivec3 v, ivec3 from) {
  return isOccupied(v + ivec3(from.x, 0, 0)) && isOccupied(v + ivec3(0, from.y, 0)) &&
         isOccupied(v + ivec3(0, 0, from.z));
}

// What a ray meets of a layer's voxel.
struct Met {
  bool isFront;
  vec3 radiance;
  uint emitters;  // VoxelLayer::emitters, 0 where not asked for
};

// mayEmit: whether `emitters` is asked for, which takes another read where the ray meets the front.
Met metIn(bool moves, uint number, vec3 way, bool mayEmit) {
  if (number >= (moves ? relumeLiveEnd.y : relumeLiveEnd.x)) return Met(true, vec3(0.0), 0u);
  vec4 front = texelFetch(relumeLiveRadiance, sideAt(2u * number), 0);
  uint axis = uint(front.w);
  vec3 toward = vec3(axis >> 16 & 255u, axis >> 8 & 255u, axis & 255u) - 128.0;
  bool isFront = dot(toward, way) < 0.0;
  if (isFront && !mayEmit) return Met(true, front.rgb, 0u);
  vec4 back = texelFetch(relumeLiveRadiance, sideAt(2u * number + 1u), 0);
  return Met(isFront, isFront ? front.rgb : back.rgb, mayEmit ? uint(back.w) : 0u);
}

// VoxelLayer::emitsToward()
bool emitsToward(Met met) { return (met.emitters >> (met.isFront ? 6 : 7) & 1u) != 0u; }

vec3 radianceMet(ivec3 v, uint sub, int across, vec3 way) {
  bool emits = relumeLiveEmits != 0u;
  ivec3 from = 2 * ivec3(lessThan(way, vec3(0.0))) - 1;
  if (isOccupied(v) && isBehindOthers(v, from)) {
    for (int a = 0; a < 3; ++a) {
      ivec3 beside = v;
      beside[a] += from[a];
      if (isBehindOthers(beside, from)) continue;
      uint moving = relumeLiveMoves != 0u ? numberAt(true, beside) : kRelumeLiveNone;
      bool moves = moving != kRelumeLiveNone;
      Met met = metIn(moves, moves ? moving : numberAt(false, beside), way, emits);
      if (!emitsToward(met)) return met.radiance;
    }
  }
  bool moves = relumeLiveMoves != 0u &&
               relumeLiveIsSet(movingSubVoxels(rayCellIndex(v >> 2), relumeLiveBit(v)), sub);
  uint number = numberAt(moves, v);
  // Its own, or of the voxel beside its corner
  ivec3 at = ivec3(sub & 3u, sub >> 2 & 3u, sub >> 4);
  for (int a = 0; a < 3 && number == kRelumeLiveNone; ++a) {
    ivec3 beside = v;
    beside[a] += at[a] < 2 ? -1 : 1;
    if (relumeLiveHolds(beside)) number = numberAt(moves, beside);
  }
  Met met = metIn(moves, number, way, emits && across >= 0);
  // VoxelLayer::isDark()
  uint face = 2u * uint(max(across, 0)) + (way[max(across, 0)] > 0.0 ? 0u : 1u);
  bool isDark = emitsToward(met) && (met.emitters >> face & 1u) != 0u;
  return isDark ? vec3(0.0) : met.radiance;
}

#ifdef RELUME_LIVE_NESTED
// leavePlace() of runtime/voxels/radiance_along.h. [voxels]
vec3 leavePlace(vec3 origin, vec3 way) {
  vec3 size = 4.0 * vec3(relumeLiveSize), t = vec3(1e30);
  for (int a = 0; a < 3; ++a) {
    if (way[a] != 0.0) t[a] = ((way[a] > 0.0 ? size[a] : 0.0) - origin[a]) / way[a];
  }
  int axis = relumeLiveFirstAxis(t);
  vec3 place = clamp(origin + t[axis] * way, vec3(0.0), size);
  place[axis] = way[axis] > 0.0 ? size[axis] + 0.01 : -0.01;
  return place;
}

vec3 radianceAlong(vec3 place, vec3 way, vec3 sky) {
  for (int volume = int(relumeLiveVolume); volume >= 0; --volume) {
    relumeLiveSize = relumeLiveSizes[volume];
    relumeLiveLayer = int(relumeLiveLayers[volume]);
    relumeLiveMoves = relumeLiveMoving[volume];
    relumeLiveEnd = relumeLiveEnds[volume];
    ivec3 v;
    uint sub;
    int across;
    if (march(place, way, v, sub, across)) return radianceMet(v, sub, across, way);
    place = 0.5 * leavePlace(place, way) + relumeLiveToOuter[volume];
  }
  return sky;
}
#else
vec3 radianceAlong(vec3 place, vec3 way, vec3 sky) {
  ivec3 v;
  uint sub;
  int across;
  return march(place, way, v, sub, across) ? radianceMet(v, sub, across, way) : sky;
}
#endif

void main() {
  uint thread = relumeLiveThread(), cache = thread / uint(RELUME_LANES) + relumeLiveFirstCache,
       lane = thread % uint(RELUME_LANES);
  bool isCache = thread < relumeLiveThreads;
  ivec2 to = ivec2(7u * (cache % uint(RELUME_LIVE_CACHES_A_ROW)), cache / uint(RELUME_LIVE_CACHES_A_ROW));
  vec3 c[9];
  for (int k = 0; k < 9; ++k) c[k] = vec3(0.0);
  float brightest = 0.0, before = 0.0;
  if (isCache) {
    before = imageLoad(lightImage, to + ivec2(6, 0)).w;
    uint at = cacheVoxel[cache];
    vec3 origin = vec3(at & 1023u, at >> 10 & 1023u, at >> 20) + 0.5;
    float weight = 12.5663706 / float(relumeLiveRayCount);
    float scale[3] = float[3](weight, weight, weight);
    for (uint i = lane; i < relumeLiveRayCount; i += uint(RELUME_LANES)) {
      vec3 way = texelFetch(relumeLiveRays, ivec2(i, 0), 0).xyz;
      vec3 radiance = radianceAlong(origin, way, texelFetch(relumeLiveRays, ivec2(i, 1), 0).rgb);
      if (radiance == vec3(0.0)) continue;
      brightest = max(brightest, max(max(radiance.r, radiance.g), radiance.b));
      vec4 y[RELUME_SH_WORDS];
      relumeEvaluateSh(way, scale, y);
      for (int k = 0; k < 9; ++k) c[k] += y[k / 4][k % 4] * radiance;
    }
  }
  vec4 sum[7] = vec4[7](vec4(c[0], c[1].r), vec4(c[1].gb, c[2].rg), vec4(c[2].b, c[3]), vec4(c[4], c[5].r),
                        vec4(c[5].gb, c[6].rg), vec4(c[6].b, c[7]), vec4(c[8], brightest));
  float keep = before < 0.0 ? 0.0 : relumeLiveKeep;
#if RELUME_LANES > 1
  uint base = 7u * (gl_LocalInvocationID.x - lane);
  for (uint k = 0u; k < 7u; ++k) part[base + 7u * lane + k] = sum[k];
  barrier();
  if (!isCache || lane >= 7u) return;
  vec4 all = part[base + lane];
  for (uint other = 1u; other < uint(RELUME_LANES); ++other) {
    vec4 more = part[base + 7u * other + lane];
    all = lane == 6u ? vec4(all.rgb + more.rgb, max(all.w, more.w)) : all + more;
  }
  vec4 old = imageLoad(lightImage, to + ivec2(lane, 0));
  imageStore(lightImage, to + ivec2(lane, 0), keep > 0.0 ? mix(all, old, keep) : all);
#else
  if (!isCache) return;
  for (int k = 0; k < 7; ++k) {
    vec4 old = imageLoad(lightImage, to + ivec2(k, 0));
    imageStore(lightImage, to + ivec2(k, 0), keep > 0.0 ? mix(sum[k], old, keep) : sum[k]);
  }
#endif
}
