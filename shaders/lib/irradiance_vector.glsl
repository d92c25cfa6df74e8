// SPDX-License-Identifier: MIT
// formats/irradiance_vector.h: irradiance from irradiance vectors. A test runs both.

// The half that a normal reads about axis a.
uint relumeHalfOf(vec3 n, int a) { return uint(2 * a) + (n[a] < 0.0 ? 1u : 0u); }

// Part n_a² b_a of E(n) by the half about axis a.
float relumeAxisPart(vec3 vector, vec3 n, int a) {
  float own = n[a] * vector[a];
  return n[a] * n[a] * (abs(n[a]) > 0.0 ? own / abs(n[a]) + (2.0 / 3.0) * (dot(n, vector) - own) : 0.0);
}

// Irradiance as Y, Co, Cg of E_Y = y and what the axes have of each channel, the sum of n_a² times relumeAxisColor().
vec3 relumeColored(float y, vec3 axes) {
  return vec3(y, axes.x > 0.0 ? y * clamp(axes.yz / axes.x, vec2(-2.0, -1.0), vec2(2.0, 1.0)) : vec2(0.0));
}

vec3 relumeAxisColor(vec3 luma, vec2 chroma, vec3 n, int a) { return vec3(n[a] < 0.0 ? -luma[a] : luma[a], chroma); }
