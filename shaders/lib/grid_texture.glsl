// SPDX-License-Identifier: MIT
// Step 6 by the grid's texture: runtime/shared/grid_texture.h says what it holds; a test runs both. Included by
// resolve.glsl.
//   vec3 relumeIrradianceGridTexture(vec3 positionWorld, vec3 n)   trilinear where the cell is open
//   vec3 relumeIrradianceGridSmooth(vec3 positionWorld, vec3 n)    by a cubic B-spline where all cells around are
// Elsewhere, and without a texture, both are relumeIrradianceGrid().
#if RELUME_GRID_TEXTURE
#include "lib/irradiance_vector.glsl"

// Luma vectors with their weight, and chroma, of the three halves that a normal reads.
struct RelumeTexels {
  vec4 luma[3];
  vec2 chroma[3];
};

// Add the texels at p, in points, which filters between them.
void relumeAddTexels(vec3 p, float weight, vec3 n, inout RelumeTexels sum) {
  vec3 size = vec3(relumeResolve.gridTextureResolution.xy, float(6u * relumeResolve.gridTextureStep - 1u));
  p.z = clamp(p.z, 0.0, float(relumeResolve.gridTextureResolution.z - 1u));
  for (int a = 0; a < 3; ++a) {
    vec3 at = (p + vec3(0.5, 0.5, 0.5 + float(relumeHalfOf(n, a) * relumeResolve.gridTextureStep))) / size;
    sum.luma[a] += weight * textureLod(relumeGridVectors, at, 0.0);
    sum.chroma[a] += weight * textureLod(relumeGridChroma, at, 0.0).xy;
  }
}

// The lower and the upper of the two places and their weights between which a cubic B-spline of four points lies (Sigg,
// Hadwiger, GPU Gems 2, chapter 20).
void relumeSplineTaps(vec3 cell, vec3 f, out vec3 low, out vec3 high, out vec3 lowWeight) {
  vec3 g = 1.0 - f, first = g * g * g / 6.0, last = f * f * f / 6.0;
  lowWeight = first + (4.0 - 3.0 * f * f * (2.0 - f)) / 6.0;
  low = cell - first / lowWeight;
  high = cell + 1.0 + last / (1.0 - lowWeight);
}

vec3 relumeReadGridTexture(vec3 positionWorld, vec3 n, bool smooth_) {
  if (!relumeFinite(positionWorld) || !relumeCanShade(n) || !(dot(n, n) > 0.0)) return relumeIrradianceGrid(positionWorld, n);
  uvec3 r = relumeResolve.gridTextureResolution;
  vec3 near = clamp(positionWorld, vec3(-RELUME_MAX_COORDINATE), vec3(RELUME_MAX_COORDINATE));
  vec3 wanted = (near - relumeResolve.gridOriginWorld) / max(relumeResolve.gridTextureSpacing, vec3(1e-20));
  vec3 p = clamp(wanted, vec3(0.0), vec3(r - 1u)), outside = abs(wanted - p);
  uvec3 cell = min(uvec3(p), max(r, uvec3(2u)) - 2u);
  uint open = relumeOpenBits(ivec3(cell));
  if (!(max(outside.x, max(outside.y, outside.z)) <= 0.5) || (open & RELUME_OPEN_CELL) == 0u) return relumeIrradianceGrid(positionWorld, n);

  vec3 m = n / sqrt(dot(n, n));
  RelumeTexels sum;
  for (int a = 0; a < 3; ++a) sum.luma[a] = vec4(0.0), sum.chroma[a] = vec2(0.0);
  if (smooth_ && (open & RELUME_OPEN_AROUND) != 0u) {
    vec3 low, high, weight;
    relumeSplineTaps(vec3(cell), p - vec3(cell), low, high, weight);
    for (uint tap = 0u; tap < 8u; ++tap) {
      bvec3 upper = bvec3((tap & 1u) != 0u, (tap & 2u) != 0u, (tap & 4u) != 0u);
      vec3 w = mix(weight, 1.0 - weight, upper);
      relumeAddTexels(mix(low, high, upper), w.x * w.y * w.z, m, sum);
    }
  } else {
    relumeAddTexels(p, 1.0, m, sum);
  }
  float known = sum.luma[0].w;
  if (!(known > RELUME_MIN_TEXEL_WEIGHT)) return relumeIrradianceGrid(positionWorld, n);
  float y = 0.0;
  vec3 axes = vec3(0.0);
  for (int a = 0; a < 3; ++a) {
    y += relumeAxisPart(sum.luma[a].xyz, m, a);
    axes += m[a] * m[a] * relumeAxisColor(sum.luma[a].xyz, sum.chroma[a], m, a);
  }
  return max(relumeYCoCgToRgb(relumeColored(y, axes)) / known, vec3(0.0));
}

vec3 relumeIrradianceGridTexture(vec3 positionWorld, vec3 n) { return relumeReadGridTexture(positionWorld, n, false); }
vec3 relumeIrradianceGridSmooth(vec3 positionWorld, vec3 n) { return relumeReadGridTexture(positionWorld, n, true); }
#else
vec3 relumeIrradianceGridTexture(vec3 positionWorld, vec3 n) { return relumeIrradianceGrid(positionWorld, n); }
vec3 relumeIrradianceGridSmooth(vec3 positionWorld, vec3 n) { return relumeIrradianceGrid(positionWorld, n); }
#endif
