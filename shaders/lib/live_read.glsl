// SPDX-License-Identifier: MIT
// Sums of caches of light without a bake, and what lobes find in them. A cache is seven texels: red, green and blue of
// nine coefficients, one after the other, then the largest channel of its brightest ray, negative where it has not
// gathered yet and has what it began with. [W/m²/sr]
layout(binding = RELUME_LIVE_UNIT_LIGHT) uniform sampler2D relumeLiveLight;

vec4 relumeLiveSum[7];
float relumeLiveMost;

ivec2 relumeLiveCacheAt(uint slot) {
  return ivec2(7u * (slot % uint(RELUME_LIVE_CACHES_A_ROW)), slot / uint(RELUME_LIVE_CACHES_A_ROW));
}

void relumeLiveClear() {
  for (int k = 0; k < 7; ++k) relumeLiveSum[k] = vec4(0.0);
  relumeLiveMost = 0.0;
}

void relumeLiveAdd(uint slot, float weight) {
  ivec2 at = relumeLiveCacheAt(slot);
  vec4 last = texelFetch(relumeLiveLight, at + ivec2(6, 0), 0);
  relumeLiveMost = max(relumeLiveMost, last.w);
  for (int k = 0; k < 6; ++k) relumeLiveSum[k] += weight * texelFetch(relumeLiveLight, at + ivec2(k, 0), 0);
  relumeLiveSum[6] += weight * last;
}

// The dot product of the sum with a lobe about a unit direction, whose bands have these factors.
vec3 relumeLiveAlong(vec3 d, vec3 factor) {
  vec4 a = relumeLiveSum[0], b = relumeLiveSum[1], c = relumeLiveSum[2], e = relumeLiveSum[3], f = relumeLiveSum[4],
       g = relumeLiveSum[5], h = relumeLiveSum[6];
  vec3 first = 0.4886025 * (d.y * vec3(a.w, b.xy) + d.z * vec3(b.zw, c.x) + d.x * c.yzw);
  vec3 second = 1.0925484 * (d.x * d.y * e.xyz + d.y * d.z * vec3(e.w, f.xy) + d.x * d.z * g.yzw) +
                0.3153916 * (3.0 * d.z * d.z - 1.0) * vec3(f.zw, g.x) +
                0.5462742 * (d.x * d.x - d.y * d.y) * h.xyz;
  return factor.x * 0.2820948 * a.xyz + factor.y * first + factor.z * second;
}

// By the clamped cosine about a unit normal, its third band nine tenths: CacheSum::irradiance(). [W/m²]
vec3 relumeLiveIrradianceOfSum(vec3 n) {
  const float pi = 3.14159265;
  return clamp(relumeLiveAlong(n, pi * vec3(1.0, 0.6666667, 0.225)), vec3(0.0), vec3(pi * relumeLiveMost));
}
