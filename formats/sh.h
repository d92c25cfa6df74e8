// SPDX-License-Identifier: MIT
// Real spherical harmonics, 1 to 8 bands, as baker, CPU runtime and GLSL all use them (shaders/lib/sh.glsl is the same
// arithmetic; a test runs both).
//
// Convention: y_l^m has index l*l + l + m, l counted from 0, no Condon-Shortley sign:
//   y_0^0 = 0.282095, (y_1^-1, y_1^0, y_1^1) = 0.488603 (y, z, x).  Orthonormal over the sphere.
// Sources: PIC Sections 3.2, 4.6, Appendices B and C with the project's errata (docs/ERRATA.md).
#pragma once

#include <glm/vec3.hpp>

#include <span>

namespace relume {

inline constexpr int kMaxBands = 8;
inline constexpr int kMaxCoefficients = kMaxBands * kMaxBands;

// Values of the first bands*bands basis functions in unit direction d. [bands 1..8] [Size y >= bands²]
void evaluateSh(int bands, const glm::vec3& d, std::span<float> y);

// Factors s_l with which a band of y(d) is scaled to become the projection of a rotationally symmetric function around
// d, relative to band 0: c_l^m = c_0 * ratio[l] * y_l^m(d) / y_0^0.  Here for the indicator function of a cone with
// half opening angle alpha: ratio[l] = Z_l / Z_0, Z_l = 2 pi Int P_l (PIC Eq. (6), App. C; Erratum: signs, scale).
// [cosAlpha -1..1] [Size ratio >= bands]
void coneBandRatios(int bands, float cosAlpha, std::span<float> ratio);

// Band factors A_l of the clamped cosine: E(n) = sum_l A_l sum_m c_l^m y_l^m(n) for radiance coefficients c.
// A = pi, 2pi/3, pi/4, 0, -pi/24, 0, pi/64, 0. (PIC App. B with n = 1, times pi)
std::span<const float> clampedCosineFactors();

// Factors s_l(n) of a normalised cos^n lobe (PIC App. B); s_l(1) * pi are the clamped cosine's. [n >= 0] [Size s >=
// bands]
void cosineLobeFactors(int bands, float n, std::span<float> s);

// Irradiance [W/m²] on a surface with unit normal n from radiance coefficients c [W/m²/sr] by the clamped cosine.
// May be negative where few bands ring: the caller clamps. [Size c >= bands²]
float irradianceClamped(int bands, std::span<const float> c, const glm::vec3& n);

// (4 pi / 3) sum_m c_1^m y_1^m(n): exact when all light arrives from the hemisphere above n, because the cosine is
// linear there. [Size c >= 4]
float irradianceLinear(std::span<const float> c, const glm::vec3& n);

// What the clamped cosine's third band would add to two bands of radiance, guessed: zonal around band 1's direction
// (ZH3: Roughton et al. 2024, Section 4), with a coefficient that follows from the ratio of the two bands. Exact for
// light from one direction and for uniform light; docs/notes/bands.md has its error. linear: (c_1^1, c_1^-1, c_1^0), a
// vector along the light. n is unit. [W/m²] for coefficients [W/m²/sr]; 0 without direction or light.
float zonalIrradiance(float c0, const glm::vec3& linear, const glm::vec3& n);

// Irradiance at a surface cache with unit normal cacheNormal for a shading normal n: irradianceLinear() and
// irradianceClamped() by the factors of surfaceLobe(). A zero cacheNormal (grid cache) gives the clamped lobe. One band
// knows no direction: it gives pi times the mean radiance of the half that a surface cache sees.
float irradianceAtSurface(int bands, std::span<const float> c, const glm::vec3& n, const glm::vec3& cacheNormal);

// Share of irradianceLinear() for a cosine between shading and cache normal: 1 above 0.995, 0 below 0.95, smooth
// between.
float surfaceBlend(float cosine);

// Factors on irradianceLinear() and irradianceClamped() at a surface cache with normal m, for cosine = dot(n, m) of the
// shading normal and geometricCosine = dot(g, m) of the receiver's own plane g. Where several caches are interpolated m
// is the mean of their normals, shorter than 1 where they differ: what each has caught of a uniform world is linear in
// m.
//
// The shares are surfaceBlend(cosine) and the rest. A cache has seen only the half of the world above m, a receiver
// whose plane is tilted sees a lune below: of a uniform world the linear form has caught g.m, the clamped one (1 + g.m)
// / 2. Dividing by that takes the lune to be as bright as the rest.
struct SurfaceLobe {
  float linear = 0.0f, clamped = 1.0f;
};
SurfaceLobe surfaceLobe(float cosine, float geometricCosine);
inline SurfaceLobe surfaceLobe(float cosine) { return surfaceLobe(cosine, cosine); }

}  // namespace relume
