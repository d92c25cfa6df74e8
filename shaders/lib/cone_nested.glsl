// SPDX-License-Identifier: MIT
// Cones through volumes that lie in one another: NestedCones::trace() (runtime/cones/nested_cones.h), which a test
// compares. Part of lib/cone_trace.glsl.

// A sample so many voxels wide of the volume that is entered. [width >= 2]
vec4 relumeConeReadWide(float width, vec3 place, vec3 way) {
  int most = int(relumeConeLevelCount);
  float level = min(log2(width), float(most));
  int below = min(int(level), most);
  vec4 further = relumeConeReadFurther(min(below + 1, most), place, way);
  if (below < 2) return mix(relumeConeReadFirst(place, way), further, level - 1.0);
  return mix(relumeConeReadFurther(below, place, way), further, level - float(below));
}

// Of any width.
vec4 relumeConeReadAt(float width, vec3 place, vec3 way, bool isNear, vec3 origin) {
  if (width >= 2.0) return relumeConeReadWide(width, place, way);
  vec4 first = relumeConeReadFirst(place, way);
  // What the filter reads of level 1 holds all voxels that are read here.
  return first.w > 0.0 ? mix(relumeConeReadVoxels(place, way, isNear, origin), first, log2(width)) : first;
}

// What a step along a cone reads of a volume.
struct RelumeNestedSample {
  vec3 place;              // [voxels]
  float width, own, side;  // [voxels] own: how far along the cone; side: [voxels of the innermost]
  float share;
};

// How far a cone has come. [voxels of the innermost volume]
struct RelumeNestedMarch {
  float t, end;
  float advance, length_;  // of the step at t; no longer than the rest
  uint volume;             // the innermost that has the step's sample, which is entered
  RelumeNestedSample s;
  vec3 radiance;
  float clear, occlusion;
};

bool relumeConeIsOn(RelumeNestedMarch m) { return m.t < m.end && m.clear > kConeSpent; }
bool relumeConeIsInside(RelumeNestedMarch m) { return relumeConeIsOn(m) && m.s.share >= 1.0; }

// What the step at t reads of the march's volume, which is entered. isFirst: it says how long the step is.
void relumeConeSampleOf(RelumeCone cone, float cosine, bool isFirst, inout RelumeNestedMarch m) {
  relumeConeEnter(m.volume);
  RelumeNestedSample s;
  s.side = float(1u << (relumeConeVolumes - 1u - m.volume));
  s.width = clamp(m.t / s.side * min(cone.spread, cosine / kConePlane), 1.0, float(1u << relumeConeLevelCount));
  if (isFirst) {
    m.advance = kConeStep * s.width * s.side;
    m.length_ = min(m.advance, m.end - m.t);
  }
  s.own = (m.t + 0.5 * m.length_) / s.side;
  s.place = (cone.origin - relumeLiveOrigin) / relumeLiveVoxel + s.own * cone.direction +
            max(0.0, kConeClear - s.own * cosine) * cone.normal;
  s.share = m.volume > 0u ? relumeConeShare(s.place, s.width) : 1.0;
  m.s = s;
}

// The step at t.
void relumeConeFind(RelumeCone cone, float cosine, inout RelumeNestedMarch m) {
  m.volume = relumeConeVolumes - 1u;
  relumeConeSampleOf(cone, cosine, true, m);
  while (!(m.s.share > 0.0)) {
    --m.volume;
    relumeConeSampleOf(cone, cosine, true, m);
  }
}

// The depth of what the step has read blocks the cone; and the next step.
void relumeConeMeets(vec4 depth, RelumeCone cone, float cosine, float falloff, float voxel, inout RelumeNestedMarch m) {
  if (depth.w > 0.0) {
    float blocked = m.clear * relumeBlocked(depth.w);
    m.radiance += (blocked / depth.w) * depth.rgb;
    m.occlusion += blocked / (1.0 + falloff * (m.t + 0.5 * m.length_) * voxel);
    m.clear -= blocked;
  }
  m.t += m.advance;
  relumeConeFind(cone, cosine, m);
}

// What the step reads, over its whole length, of the volumes that share it.
vec4 relumeConeReadStep(RelumeCone cone, float cosine, inout RelumeNestedMarch m) {
  vec4 depth = vec4(0.0);
  for (float rest = 1.0; rest > 0.0;) {
    vec3 origin = (cone.origin - relumeLiveOrigin) / relumeLiveVoxel;
    if (m.s.share > 0.0)
      depth += rest * m.s.share * (m.length_ / (m.s.side * m.s.width)) *
               relumeConeReadAt(m.s.width, m.s.place, cone.direction, m.s.own < kConeNear, origin);
    rest *= 1.0 - m.s.share;
    if (!(rest > 0.0)) continue;
    --m.volume;
    relumeConeSampleOf(cone, cosine, false, m);
  }
  return depth;
}

// Radiance with what lies beyond the volumes, and occlusion. Well inside of a volume each range of widths has a loop of
// its own that reads no more than it needs: software executes both branches of a condition. With RELUME_CONE_ONE_LOOP
// all steps are one loop: of threads that run together some are in this volume and some in that, and each loop waits
// for the longest.
vec4 relumeConeFollow(RelumeCone cone, float falloff) {
  vec3 way = cone.direction;
  if (!relumeConeIsUnit(cone.normal) || !relumeConeIsUnit(way)) return vec4(relumeSkyAlong(way), 0.0);
  float cosine = dot(way, cone.normal);
  relumeConeEnter(0u);
  float outermost = float(1u << (relumeConeVolumes - 1u)), voxel = relumeLiveVoxel / outermost;
  RelumeNestedMarch m;
  vec3 origin = (cone.origin - relumeLiveOrigin) / relumeLiveVoxel;
  relumeConeClip(origin, way, m.t, m.end);
  m.t *= outermost;
  m.end *= outermost;
  m.radiance = vec3(0.0);
  m.clear = 1.0;
  m.occlusion = 0.0;
  relumeConeFind(cone, cosine, m);

#if defined(RELUME_CONE_ONE_LOOP)
  while (relumeConeIsOn(m)) {
    vec4 depth = relumeConeReadStep(cone, cosine, m);
    relumeConeMeets(depth, cone, cosine, falloff, voxel, m);
  }
#else
  while (relumeConeIsOn(m)) {
    // Beside its own walls
    while (relumeConeIsInside(m) && m.s.own < kConeNear) {
      origin = (cone.origin - relumeLiveOrigin) / relumeLiveVoxel;
      vec4 depth = relumeConeReadVoxels(m.s.place, way, true, origin);
      if (m.s.width > 1.0) depth = mix(depth, relumeConeReadFirst(m.s.place, way), log2(m.s.width));
      relumeConeMeets(m.length_ / (m.s.side * m.s.width) * depth, cone, cosine, falloff, voxel, m);
    }
    // Voxels, and level 1
    while (relumeConeIsInside(m) && m.s.own >= kConeNear && m.s.width < 2.0) {
      vec4 first = relumeConeReadFirst(m.s.place, way), depth = vec4(0.0);
      if (first.w > 0.0) depth = mix(relumeConeReadVoxels(m.s.place, way, false, origin), first, log2(m.s.width));
      relumeConeMeets(m.length_ / (m.s.side * m.s.width) * depth, cone, cosine, falloff, voxel, m);
    }
    // Further levels
    while (relumeConeIsInside(m) && m.s.own >= kConeNear && m.s.width >= 2.0) {
      vec4 depth = relumeConeReadWide(m.s.width, m.s.place, way);
      relumeConeMeets(m.length_ / (m.s.side * m.s.width) * depth, cone, cosine, falloff, voxel, m);
    }
    // Where one volume takes over from another
    while (relumeConeIsOn(m) && m.s.share < 1.0) {
      vec4 depth = relumeConeReadStep(cone, cosine, m);
      relumeConeMeets(depth, cone, cosine, falloff, voxel, m);
    }
  }
#endif
  if (m.clear <= kConeSpent) return vec4(m.radiance, m.occlusion) / (1.0 - m.clear);
  return vec4(m.radiance + m.clear * relumeSkyAlong(way), m.occlusion);
}
