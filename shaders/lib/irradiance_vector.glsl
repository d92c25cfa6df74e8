// SPDX-License-Identifier: MIT
// formats/irradiance_vector.h: irradiance from irradiance vectors. A test runs both.

// The half that a normal reads about axis a.
uint relumeHalfOf(vec3 n, int a) { return uint(2 * a) + (n[a] < 0.0 ? 1u : 0u); }

// Part n_a² b_a of E(n) by the half about axis a.
float relumeAxisPart(vec3 vector, vec3 n, int a) {
  float own = n[a] * vector[a];
  return n[a] * n[a] * (abs(n[a]) > 0.0 ? own / abs(n[a]) + (2.0 / 3.0) * (dot(n, vector) - own) : 0.0);
}

// That part's irradiance as Y, Co, Cg. chroma: the projections of Co's and Cg's vectors.
vec3 relumeAxisYCoCg(vec3 luma, vec2 chroma, vec3 n, int a) {
  float part = relumeAxisPart(luma, n, a), length2 = dot(luma, luma);
  return vec3(part, length2 > 0.0 ? part / sqrt(length2) * chroma : vec2(0.0));
}
