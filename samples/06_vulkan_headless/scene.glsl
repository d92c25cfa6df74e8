// SPDX-License-Identifier: MIT
// The sample's level, in descriptor set 1: rays against its triangles, mesh by mesh, and direct light with shadows. A game
// has its own of both: shadow maps or ray queries.
struct Corner {
  vec4 position;  // w: u on the light map
  vec4 normal;    // w: v
  vec4 uv;        // of the material's image
};
struct Mesh {
  vec4 low;   // bounds; w: its first triangle
  vec4 high;  // w: how many it has
  vec4 color;
  vec4 emission;  // w: alpha below which nothing is there
  uvec4 image;    // first texel, width and height; 0 x 0 = none
};
layout(std430, set = 1, binding = 0) readonly buffer Corners { Corner corner[]; };
layout(std430, set = 1, binding = 1) readonly buffer Meshes { Mesh mesh[]; };
layout(std430, set = 1, binding = 2) writeonly buffer Pixels { uint pixel[]; };
layout(std430, set = 1, binding = 3) readonly buffer Texels { uint texel[]; };  // RGBA, sRGB

layout(push_constant) uniform Frame {
  mat4 worldFromCamera;
  vec4 sunDirection;   // w: tangent of half the vertical field of view
  vec4 sunIrradiance;  // w: width of the picture
  vec4 lampPosition;   // w: height
  vec4 lampIntensity;  // w: 1 = indirect irradiance / pi alone
};

struct Hit {
  float t;
  uint mesh, triangle;
  vec2 at;  // barycentric
};

vec3 interpolate(vec3 a, vec3 b, vec3 c, vec2 at) { return (1.0 - at.x - at.y) * a + at.x * b + at.y * c; }

// Base colour of a hit, linear; its nearest texel, repeated.
vec4 colorOf(Hit hit) {
  Mesh m = mesh[hit.mesh];
  if (m.image.y == 0u) return m.color;
  uint i = 3u * hit.triangle;
  vec2 uv = fract(interpolate(corner[i].uv.xyz, corner[i + 1u].uv.xyz, corner[i + 2u].uv.xyz, hit.at).xy);
  uvec2 at = min(uvec2(uv * vec2(m.image.yz)), m.image.yz - 1u);
  vec4 c = unpackUnorm4x8(texel[m.image.x + at.y * m.image.y + at.x]);
  return m.color * vec4(mix(c.rgb / 12.92, pow((c.rgb + 0.055) / 1.055, vec3(2.4)), greaterThan(c.rgb, vec3(0.04045))), c.a);
}

bool meetsBox(vec3 from, vec3 inverse, vec3 low, vec3 high, float t) {
  vec3 a = (low - from) * inverse, b = (high - from) * inverse, near = min(a, b), far = max(a, b);
  float begin = max(max(near.x, near.y), max(near.z, 0.0)), end = min(min(far.x, far.y), min(far.z, t));
  return begin <= end;
}

// The nearest triangle before hit.t, or any (Möller and Trumbore 1997).
bool trace(vec3 from, vec3 direction, bool any_, inout Hit hit) {
  bool found = false;
  vec3 inverse = 1.0 / mix(direction, vec3(1e-20), lessThan(abs(direction), vec3(1e-20)));
  for (uint m = 0u; m < uint(mesh.length()); ++m) {
    if (!meetsBox(from, inverse, mesh[m].low.xyz - 1e-4, mesh[m].high.xyz + 1e-4, hit.t)) continue;
    uint first = uint(mesh[m].low.w), end = first + uint(mesh[m].high.w);
    for (uint i = first; i < end; ++i) {
      vec3 a = corner[3u * i].position.xyz, ab = corner[3u * i + 1u].position.xyz - a, ac = corner[3u * i + 2u].position.xyz - a;
      vec3 p = cross(direction, ac), s = from - a, q = cross(s, ab);
      float scale = 1.0 / dot(ab, p), u = scale * dot(s, p), v = scale * dot(direction, q), t = scale * dot(ac, q);
      if (!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < hit.t)) continue;
      Hit candidate = Hit(t, m, i, vec2(u, v));
      if (mesh[m].emission.w > 0.0 && colorOf(candidate).a < mesh[m].emission.w) continue;
      hit = candidate;
      found = true;
      if (any_) return true;
    }
  }
  return found;
}

bool sees(vec3 from, vec3 toward, float distance_) {
  Hit hit = Hit(distance_, 0u, 0u, vec2(0.0));
  return !trace(from, toward, true, hit);
}

vec3 directIrradiance(vec3 p, vec3 n) {
  vec3 light = vec3(0.0), from = p + 1e-3 * n, toLamp = lampPosition.xyz - from;
  float cosine = -dot(sunDirection.xyz, n), d = length(toLamp);
  if (cosine > 0.0 && sees(from, -sunDirection.xyz, 1e9)) light += sunIrradiance.rgb * cosine;
  cosine = dot(toLamp, n) / max(d, 1e-4);
  if (cosine > 0.0 && sees(from, toLamp / d, 0.999 * d)) light += lampIntensity.rgb * cosine / (d * d);
  return light;
}
