// SPDX-License-Identifier: MIT
// The game's GLSL 3.30. OGRE fills in what its lights and shadow textures say; Relume's resolve is put in front of
// kFragment.
#pragma once

// Direct light with its shadows, which pixels and surfels share. Light 0 is the sun, 1 to 6 are the sides of the lamp.
inline const char* const kDirect = R"(
uniform vec4 lightPosition[2];   // of the sun: the way to it
uniform vec4 lightIntensity[2];  // W/m² of the sun, W/sr of the lamp
uniform vec4 lightDirection[7];
uniform mat4 mapFromWorld[7];
uniform float sunTexel;          // [m] of its shadow texture
uniform sampler2DShadow shadow0, shadow1, shadow2, shadow3, shadow4, shadow5, shadow6;

vec3 inMap(vec4 q, float bias) { return vec3(q.xy / q.w, 0.5 * q.z / q.w + 0.5 - bias); }

vec3 directIrradiance(vec3 p, vec3 n) {
  vec3 light = vec3(0.0), toLamp = lightPosition[1].xyz - p;
  float c = dot(lightPosition[0].xyz, n);
  if (c > 0.0)
    light += lightIntensity[0].rgb * c * texture(shadow0, inMap(mapFromWorld[0] * vec4(p + n * 2.0 * sunTexel, 1.0), 0.0));
  float r2 = max(dot(toLamp, toLamp), 1e-8);
  c = dot(toLamp, n) * inversesqrt(r2);
  if (c > 0.0) {
    int side = 1;  // the one that looks this way
    for (int i = 2; i < 7; ++i)
      if (dot(lightDirection[i].xyz, toLamp) < dot(lightDirection[side].xyz, toLamp)) side = i;
    vec3 q = inMap(mapFromWorld[side] * vec4(p + n * 0.02, 1.0), 1e-4);
    float seen = side == 1 ? texture(shadow1, q) : side == 2 ? texture(shadow2, q) : side == 3 ? texture(shadow3, q)
               : side == 4 ? texture(shadow4, q) : side == 5 ? texture(shadow5, q) : texture(shadow6, q);
    light += lightIntensity[1].rgb * c / r2 * seen;
  }
  return light;
}
)";

inline const char* const kVertex = R"(
in vec4 vertex;
in vec3 normal;
in vec2 uv0, uv1;
uniform mat4 worldFromModel, clipFromModel;
out vec3 worldPosition, worldNormal;
out vec2 materialUv, mapUv;
void main() {
  worldPosition = (worldFromModel * vertex).xyz;
  worldNormal = mat3(worldFromModel) * normal;
  materialUv = uv0;
  mapUv = uv1;
  gl_Position = clipFromModel * vertex;
}
)";

// The picture. Backs of the level's surfaces and all that moves are lit by the grid. gl_FrontFacing is of no use here:
// OGRE draws into textures upside down.
inline const char* const kFragment = R"(
in vec3 worldPosition, worldNormal;
in vec2 materialUv, mapUv;
uniform sampler2D image;
uniform vec4 color;
uniform vec4 emission;  // w: alpha below which nothing is there
uniform vec4 show;      // factors on direct and indirect light; z: 1 = irradiance / pi alone; w: 1 = moves
uniform vec3 eye;
out vec4 result;
vec3 filmic(vec3 x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }  // Narkowicz 2015, ACES fit
vec3 srgb(vec3 x) { return mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThan(x, vec3(0.0031308))); }
void main() {
  vec4 albedo = color * texture(image, materialUv);
  if (albedo.a < emission.w) discard;
  vec3 plane = normalize(cross(dFdx(worldPosition), dFdy(worldPosition)));
  if (dot(plane, eye - worldPosition) < 0.0) plane = -plane;
  vec3 n = normalize(worldNormal);
  bool isFront = dot(n, plane) > 0.0;
  if (!isFront) n = -n;
  bool byGrid = show.w > 0.0 || !isFront || min(mapUv.x, mapUv.y) > 0.99999;
  vec3 indirect = byGrid ? relumeIrradianceGrid(worldPosition, n) : relumeIrradianceLightmap(mapUv, n, plane);
  vec3 light = (show.x * directIrradiance(worldPosition, n) + show.y * indirect) / 3.14159265;
  if (show.z == 0.0) light = filmic(light * albedo.rgb + emission.rgb);
  float alpha = relumeGrid[5].w < 0.0 ? 0.0 : 1.0;  // always 1: OGRE asserts that arrays are read to their ends
  result = vec4(srgb(clamp(light, 0.0, 1.0)), alpha);
}
)";

// Shadow textures: depth alone, and holes where the level has them.
inline const char* const kCasterFragment = R"(
in vec2 materialUv;
uniform sampler2D image;
uniform vec4 color;
uniform vec4 emission;
void main() {
  if (color.a * texture(image, materialUv).a < emission.w) discard;
}
)";

// Surfels: points, each on a texel of its own, whose colour is the irradiance of the game's lights there.
inline const char* const kSurfelVertex = R"(
in vec4 vertex;
in vec3 normal;
in vec2 uv0;
out vec3 worldPosition, worldNormal;
void main() {
  worldPosition = vertex.xyz;
  worldNormal = normal;
  gl_Position = vec4(uv0, 0.0, 1.0);
}
)";

inline const char* const kSurfelFragment = R"(
in vec3 worldPosition, worldNormal;
out vec4 irradiance;
void main() { irradiance = vec4(directIrradiance(worldPosition, worldNormal), 1.0); }
)";
