// SPDX-License-Identifier: MIT
// runtime/cpu/light_surfels.h, directIrradiance(): light at a surfel, shadows left out. Lights are those of shared/layout.h.
vec3 relumeDirectIrradiance(RelumeLight l, vec3 position, vec3 normal) {
  if (l.position.w < 0.0) return l.intensity.rgb * max(-dot(l.direction.xyz, normal), 0.0);
  vec3 toward = l.position.xyz - position;
  float d2 = dot(toward, toward), cosineTimesD = max(dot(toward, normal), 0.0);
  float inverseD = inversesqrt(max(d2, 1e-12)), share = d2 * l.position.w;
  float edge = clamp(l.intensity.w - dot(l.direction.xyz, toward) * inverseD * l.direction.w, 0.0, 1.0);
  return l.intensity.rgb * (cosineTimesD * inverseD / max(d2, 1e-8) * max(1.0 - share * share, 0.0) * edge * edge);
}

// What counts of the share of light that the host's relumeVisibility() lets through, as on the CPU (relume/lights.h): 0 to
// 1, and 0 of what is no number, which would never leave the bounces. By its bits, as drivers may take comparisons with
// what is no number either way: those of positive numbers and of infinity alone are no larger.
float relumeClampedVisibility(float visible) {
  return floatBitsToUint(visible) <= 0x7F800000u ? min(visible, 1.0) : 0.0;
}
