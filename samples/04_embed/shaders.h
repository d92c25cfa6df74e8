// SPDX-License-Identifier: MIT
// The game's GLSL. Relume's own is put between: kResolve and kSurfels say where.
#pragma once

// Every program: this frame, and direct light with its shadows, which pixels and surfels share.
inline const char* const kFrame = R"(
layout(std140, binding = 0) uniform Frame {
  mat4 clipFromWorld, worldFromClip, sunMapFromWorld;
  vec4 sunDirection, sunIrradiance;  // w of the first: [m] a texel of its map
  vec4 lampPosition, lampIntensity;  // w of the first: [m] how far its map sees, from 0.02 on
  vec4 show;                         // factors on direct and indirect light; w: 1 = irradiance / pi alone
};
layout(binding = 4) uniform sampler2DShadow sunMap;
layout(binding = 5) uniform samplerCubeShadow lampMap;

vec3 directIrradiance(vec3 p, vec3 n) {
  vec3 light = vec3(0.0), toLamp = lampPosition.xyz - p;
  float c = -dot(sunDirection.xyz, n), r2 = max(dot(toLamp, toLamp), 1e-8);
  vec3 q = (sunMapFromWorld * vec4(p + n * 2.0 * sunDirection.w, 1.0)).xyz;
  if (c > 0.0) light += sunIrradiance.rgb * c * texture(sunMap, q);
  c = dot(toLamp, n) * inversesqrt(r2);
  vec3 from = p + n * 0.02 - lampPosition.xyz, a = abs(from);
  float far = lampPosition.w, z = max(a.x, max(a.y, a.z));  // depth as the side of the cube has it
  float depth = far / (far - 0.02) * (1.0 - 0.02 / z) - 1e-4;
  if (c > 0.0) light += lampIntensity.rgb * c / r2 * texture(lampMap, vec4(from, depth));
  return light;
}
)";

inline const char* const kSolidVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec2 lightmapUv;
layout(location = 0) uniform mat4 worldFromModel;
layout(location = 1) uniform mat4 clipFromWorldOfPass;
out vec3 worldPosition, worldNormal;
out vec2 materialUv, mapUv;
void main() {
  vec4 p = worldFromModel * vec4(position, 1.0);
  worldPosition = p.xyz;
  worldNormal = mat3(worldFromModel) * normal;
  materialUv = uv;
  mapUv = lightmapUv;
  gl_Position = clipFromWorldOfPass * p;
}
)";

// The G-buffer, and with no colour attached the shadow maps. The light map's coordinate is 16 bits in the level and
// here, so that (1, 1) stays exactly that.
inline const char* const kSolidFragment = R"(
in vec3 worldPosition, worldNormal;
in vec2 materialUv, mapUv;
layout(location = 2) uniform vec4 color;
layout(location = 3) uniform vec4 emission;  // w: alpha below which nothing is there
layout(binding = 0) uniform sampler2D image;
layout(location = 0) out vec4 albedo;
layout(location = 1) out vec3 shadingNormal;
layout(location = 2) out vec3 geometricNormal;
layout(location = 3) out vec2 lightmapUv;
layout(location = 4) out vec3 emitted;
void main() {
  albedo = color * texture(image, materialUv);
  if (albedo.a < emission.w) discard;
  shadingNormal = (gl_FrontFacing ? 1.0 : -1.0) * normalize(worldNormal);
  geometricNormal = normalize(cross(dFdx(worldPosition), dFdy(worldPosition)));
  lightmapUv = gl_FrontFacing ? mapUv : vec2(1.0);  // backs read the grid
  emitted = emission.rgb;
}
)";

inline const char* const kFullScreenVertex = R"(
void main() { gl_Position = vec4(4.0 * (gl_VertexID & 1) - 1.0, 2.0 * (gl_VertexID & 2) - 1.0, 0.0, 1.0); }
)";

// The lighting pass, with kFrame and Relume's resolve before it.
inline const char* const kLightingFragment = R"(
layout(binding = 0) uniform sampler2D albedoMap;
layout(binding = 1) uniform sampler2D shadingNormalMap;
layout(binding = 2) uniform sampler2D geometricNormalMap;
layout(binding = 3) uniform sampler2D lightmapUvMap;
layout(binding = 6) uniform sampler2D emissionMap;
layout(binding = 7) uniform sampler2D depthMap;
out vec4 result;
vec3 filmic(vec3 x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }  // Narkowicz 2015, ACES fit
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 light = vec3(0.0), ndc = vec3(gl_FragCoord.xy / vec2(textureSize(depthMap, 0)), texelFetch(depthMap, pixel, 0).r);
  if (ndc.z < 1.0) {
    vec4 h = worldFromClip * vec4(2.0 * ndc - 1.0, 1.0);
    vec3 p = h.xyz / h.w, n = texelFetch(shadingNormalMap, pixel, 0).xyz;
    vec2 uv = texelFetch(lightmapUvMap, pixel, 0).xy;
    vec3 indirect = uv == vec2(1.0) ? relumeIrradianceGrid(p, n)
                                    : relumeIrradianceLightmap(uv, n, texelFetch(geometricNormalMap, pixel, 0).xyz);
    light = (show.x * directIrradiance(p, n) + show.y * indirect) / 3.14159265;
    if (show.w == 0.0)
      light = light * texelFetch(albedoMap, pixel, 0).rgb + texelFetch(emissionMap, pixel, 0).rgb;
  }
  result = vec4(clamp(show.w == 0.0 ? filmic(light) : light, 0.0, 1.0), 1.0);
}
)";

// Direct light at the surfels, with kFrame and Relume's surfels before it: what a game lights its pixels with lights
// them, too.
inline const char* const kSurfelCompute = R"(
layout(local_size_x = 64) in;
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < relumeSurfelSlots)
    relumeSetSurfelIrradiance(i, directIrradiance(relumeSurfelPosition(i), relumeSurfelNormal(i)));
}
)";
