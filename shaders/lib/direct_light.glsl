// SPDX-License-Identifier: MIT
const float kRelumeDiscReach = 8.0;  // kDiscReach

// runtime/direct_light.cpp, discFactor(): from a height above a disc's plane and a distance from its middle, in radii
float relumeDiscFactor(float height, float distance2, float radius) {
  float b = height * height, u = distance2 - 1.0, w = max(sqrt(u * u + 4.0 * b), 1e-15);
  float across2 = (u > 0.0 ? 2.0 * b / (w + u) : 0.5 * (w - u)) / w;
  float x = min(sqrt(across2 / max(distance2, b + 1.0)), 1.0);
  return 2.0 * x / ((1.0 + sqrt(1.0 - x)) * radius * radius);
}

// runtime/direct_light.h, directIrradiance(): light at a point, or its mean over a disc of a radius [m], shadows left out.
// Lights are those of shared/layout.h.
vec3 relumeDirectIrradiance(RelumeLight l, vec3 position, vec3 normal, float radius) {
  if (l.position.w < 0.0) return l.intensity.rgb * max(-dot(l.direction.xyz, normal), 0.0);
  vec3 toward = l.position.xyz - position;
  float d2 = dot(toward, toward), cosineTimesD = max(dot(toward, normal), 0.0);
  float inverseD = inversesqrt(max(d2, 1e-12)), share = d2 * l.position.w;
  float edge = clamp(l.intensity.w - dot(l.direction.xyz, toward) * inverseD * l.direction.w, 0.0, 1.0);
  float factor = cosineTimesD * inverseD / max(d2, 1e-8);
  if (cosineTimesD > 0.0 && d2 < kRelumeDiscReach * kRelumeDiscReach * radius * radius)
    factor = relumeDiscFactor(cosineTimesD / radius, d2 / (radius * radius), radius);
  return l.intensity.rgb * (factor * max(1.0 - share * share, 0.0) * edge * edge);
}

// What counts of the share of light that the host's relumeVisibility() lets through, as on the CPU (relume/lights.h): 0 to
// 1, and 0 of what is no number, which would never leave the bounces. By its bits, as drivers may take comparisons with
// what is no number either way: those of positive numbers and of infinity alone are no larger.
float relumeClampedVisibility(float visible) {
  return floatBitsToUint(visible) <= 0x7F800000u ? min(visible, 1.0) : 0.0;
}
