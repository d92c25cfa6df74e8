// SPDX-License-Identifier: MIT
// Cones through volumes that lie in one another: NestedCones::trace() (runtime/cones/nested_cones.h), which a test
// compares. Part of lib/cone_trace.glsl.

// A sample so many voxels wide of the volume that was entered.
vec4 relumeConeReadAt(float width, vec3 place, vec3 way, bool isNear, vec3 origin) {
  float level = log2(width);
  int most = int(relumeConeLevelCount), below = min(int(level), most);
  if (width >= 4.0)
    return mix(relumeConeReadFurther(below, place, way), relumeConeReadFurther(min(below + 1, most), place, way),
               min(level, float(most)) - float(below));
  vec4 first = relumeConeReadFirst(place, way);
  if (width >= 2.0) return mix(first, relumeConeReadFurther(2, place, way), level - 1.0);
  // What the filter reads of level 1 holds all voxels that are read here.
  return first.w > 0.0 ? mix(relumeConeReadVoxels(place, way, isNear, origin), first, level) : first;
}

// What a step along a cone reads of a volume.
struct RelumeNestedSample {
  vec3 place;              // [voxels]
  float width, own, side;  // [voxels] own: how far along the cone; side: [voxels of the innermost]
  float share;
};

// The step that begins at t, of the volume that is entered; isFirst: which says how long it is. [voxels of the
// innermost]
RelumeNestedSample relumeConeStepAt(uint volume, RelumeCone cone, float cosine, float t, float end, bool isFirst,
                                    inout float length_) {
  relumeConeEnter(volume);
  RelumeNestedSample s;
  s.side = float(1u << (relumeConeVolumes - 1u - volume));
  s.width = clamp(t / s.side * min(cone.spread, cosine / kConePlane), 1.0, float(1u << relumeConeLevelCount));
  if (isFirst) length_ = min(kConeStep * s.width * s.side, end - t);
  s.own = (t + 0.5 * length_) / s.side;
  s.place = (cone.origin - relumeLiveOrigin) / relumeLiveVoxel + s.own * cone.direction +
            max(0.0, kConeClear - s.own * cosine) * cone.normal;
  s.share = volume > 0u ? relumeConeShare(s.place, s.width) : 1.0;
  return s;
}

// Radiance with what lies beyond the volumes, and occlusion.
vec4 relumeConeFollow(RelumeCone cone, float falloff) {
  vec3 way = cone.direction;
  if (!relumeConeIsUnit(cone.normal) || !relumeConeIsUnit(way)) return vec4(relumeSkyAlong(way), 0.0);
  float cosine = dot(way, cone.normal);
  // Lengths along the cone are in voxels of the innermost volume, places in those of each. Where along it the outermost
  // lies, a voxel more on all sides:
  relumeConeEnter(0u);
  float outermost = float(1u << (relumeConeVolumes - 1u)), voxel = relumeLiveVoxel / outermost, t = 0.0, end = 1e30;
  vec3 origin = (cone.origin - relumeLiveOrigin) / relumeLiveVoxel;
  for (int k = 0; k < 3; ++k) {
    float d = way[k], low = -1.0 - origin[k], high = float(4u * relumeLiveSize[k]) + 1.0 - origin[k];
    if (abs(d) < 1e-9) {
      if (low > 0.0 || high < 0.0) end = t;
      continue;
    }
    float a = low / d, b = high / d;
    t = max(t, min(a, b));
    end = min(end, max(a, b));
  }
  t *= outermost;
  end *= outermost;

  vec3 radiance = vec3(0.0);
  float clear = 1.0, occlusion = 0.0;
  while (t < end && clear > kConeSpent) {
    // The innermost volume that has the sample says how long it is.
    float length_ = 0.0, advance;
    uint volume = relumeConeVolumes - 1u;
    RelumeNestedSample s = relumeConeStepAt(volume, cone, cosine, t, end, true, length_);
    for (; !(s.share > 0.0); s = relumeConeStepAt(volume, cone, cosine, t, end, true, length_)) --volume;
    advance = kConeStep * s.width * s.side;
    vec4 depth = vec4(0.0);  // over the whole step
    for (float rest = 1.0; rest > 0.0;) {
      if (s.share > 0.0)
        depth += rest * s.share * (length_ / (s.side * s.width)) *
                 relumeConeReadAt(s.width, s.place, way, s.own < kConeNear,
                                  (cone.origin - relumeLiveOrigin) / relumeLiveVoxel);
      rest *= 1.0 - s.share;
      if (rest > 0.0) s = relumeConeStepAt(--volume, cone, cosine, t, end, false, length_);
    }
    float middle = t + 0.5 * length_;
    t += advance;
    if (!(depth.w > 0.0)) continue;
    float blocked = clear * relumeBlocked(depth.w);
    radiance += (blocked / depth.w) * depth.rgb;
    occlusion += blocked / (1.0 + falloff * middle * voxel);
    clear -= blocked;
  }
  if (clear <= kConeSpent) return vec4(radiance, occlusion) / (1.0 - clear);
  return vec4(radiance + clear * relumeSkyAlong(way), occlusion);
}
