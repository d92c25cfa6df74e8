// SPDX-License-Identifier: MIT
// The picture, behind Relume's resolve and scene.glsl: a ray for each pixel, direct and indirect light where it ends.
layout(local_size_x = 8, local_size_y = 8) in;

vec3 filmic(vec3 x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }  // Narkowicz 2015, ACES fit

uint toSrgb(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  c = mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
  uvec3 byte_ = uvec3(255.0 * c + 0.5);
  return byte_.r | byte_.g << 8 | byte_.b << 16 | 255u << 24;
}

void main() {
  uvec2 size = uvec2(sunIrradiance.w, lampPosition.w), at = gl_GlobalInvocationID.xy;
  if (any(greaterThanEqual(at, size))) return;
  vec2 p = (2.0 * (vec2(at) + 0.5) - vec2(size)) / float(size.y) * sunDirection.w;
  vec3 from = worldFromCamera[3].xyz, direction = normalize(mat3(worldFromCamera) * vec3(p.x, -p.y, -1.0));
  Hit hit = Hit(1e9, 0u, 0u, vec2(0.0));
  vec3 light = vec3(0.0);
  if (trace(from, direction, false, hit)) {
    Corner a = corner[3u * hit.triangle], b = corner[3u * hit.triangle + 1u], c = corner[3u * hit.triangle + 2u];
    vec3 position = from + hit.t * direction, n = normalize(interpolate(a.normal.xyz, b.normal.xyz, c.normal.xyz, hit.at));
    vec3 geometric = normalize(cross(b.position.xyz - a.position.xyz, c.position.xyz - a.position.xyz));
    bool front = dot(geometric, direction) < 0.0;
    if (!front) geometric = -geometric, n = -n;
    vec2 uv = interpolate(vec3(a.position.w, a.normal.w, 0.0), vec3(b.position.w, b.normal.w, 0.0),
                          vec3(c.position.w, c.normal.w, 0.0), hit.at).xy;
    // What has no place on the light map, (1, 1) at its corners, and the backs of what has read the grid.
    bool mapped = front && vec2(a.position.w, a.normal.w) != vec2(1.0);
    vec3 indirect = mapped ? relumeIrradianceLightmap(uv, n, geometric) : relumeIrradianceGrid(position, n);
    light = lampIntensity.w > 0.0 ? indirect / 3.14159265
                                  : filmic(colorOf(hit).rgb * (directIrradiance(position, n) + indirect) / 3.14159265 +
                                           mesh[hit.mesh].emission.rgb);
  }
  pixel[at.y * size.x + at.x] = toSrgb(light);
}
