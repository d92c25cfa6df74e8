// SPDX-License-Identifier: MIT
// Irradiance vectors: light at a point as six vectors, one for each half of the sphere about an axis, after Pacanowski
// et al., "Volumetric Vector-Based Representation for Indirect Illumination Caching", INRIA RR-6983, 2009 (IVG).
// shaders/lib/irradiance_vector.glsl is the same arithmetic; a test runs both.
//
// Vector of half d: I_d = Int over {w: w . d > 0} of L(w) w dw [W/m²], w toward the light (IVG Eq. (1)). Halves are in
// the order +x -x +y -y +z -z. I_{+a} + I_{-a} is the same for the three axes: 12 of the 18 numbers are independent.
//
// Irradiance for a unit normal n reads the three halves on the normal's side, I_a for axis a with s_a = sign(n_a):
//
//   E(n) = sum_a n_a² b_a,   b_a = s_a (I_a)_a + kappa sum_{b != a} n_b (I_a)_b
//
// Deviation: IVG 4.1 prints E(n) = <sum_a n_a² I_a, n>, that is |n_a| in place of the 1 before s_a (I_a)_a, and
// kappa 1. Uniform light then gives pi sum |n_a|³, three quarters of pi in the mean. The form above is exact for
// uniform light and at the six axes; kappa minimises the error on baked levels (docs/notes/vectors.md).
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace relume {

// One channel of light at a point [W/m²], in the order of the halves above.
using SixVectors = std::array<glm::vec3, 6>;

// kappa of the form that is used.
inline constexpr float kCrossWeight = 2.0f / 3.0f;

// Which form of E(n): the one that is used, or the paper's, for comparisons.
enum class DirectionWeights { corrected, printed };

// Factors that take coefficients of radiance to vectors: component b of the vector of half +a is
//   sum_i factors[(3 a + b) * kMaxCoefficients + i] c_i,   with the integral of y_i(w) w_b over that half,
// and that of half -a the same with the signs of the even bands turned. [Size 9 * kMaxCoefficients]
std::span<const float> vectorFactors();

// Vectors of radiance with coefficients c [W/m²/sr] (formats/sh.h). [bands 1..8] [Size c >= bands²]
SixVectors vectorsFromSh(int bands, std::span<const float> c);

// The half that a normal reads about axis a, 0 to 5. NaN and zero read the positive one.
inline std::size_t halfOf(const glm::vec3& n, int a) { return static_cast<std::size_t>(2 * a + (n[a] < 0.0f ? 1 : 0)); }

// Parts n_a² b_a of E(n), of vectors I_a of the three halves that n reads; E(n) is their sum. [n unit] [W/m²]
glm::vec3 axisParts(const std::array<glm::vec3, 3>& halves, const glm::vec3& n,
                    DirectionWeights weights = DirectionWeights::corrected, float crossWeight = kCrossWeight);

// E(n) [W/m²]; may be negative where the light was cut off after a few bands: the caller clamps. [n unit]
float irradianceFromVectors(const SixVectors& vectors, const glm::vec3& n,
                            DirectionWeights weights = DirectionWeights::corrected, float crossWeight = kCrossWeight);

// Adds a cone of radiance [W/m²/sr] about a unit direction d, half opening angle alpha, to the halves it lights. Exact,
// by Int w dw = 1/2 Int p x dp around the outline p of a region of the sphere: the part above the plane of axis e is
// bounded by an arc of the cone's circle, -phi .. phi about u, and one of a great circle, of angle 2 psi,
//   phi sin²(alpha) d - sin(phi) sin(alpha) cos(alpha) u + psi e,   with e = s d + t u, |u| = 1,
//   cos(phi) = -s cot(alpha) / t,   tan(psi) = t sin(phi) tan(alpha).
// [cosAlpha 0..1]
void addCone(SixVectors& vectors, const glm::vec3& direction, float cosAlpha, float radiance);

// One half's vectors of the three channels Y, Co, Cg (formats/color.h), as a texel of the grid's texture keeps it: the
// luma vector, and of the chroma vectors the components along the half's axis, which are irradiance for that normal.
// All filter linearly.
//
// Deviation: IVG 4.2 keeps the norms of the colours' vectors and the direction of their sum. Norms overestimate where
// these differ in direction, and unit directions do not filter linearly. Chroma vectors' projections on the luma vector
// would fit in as many bytes: their colours err more, as light that grazes the axis counts in full
// (docs/notes/vectors.md).
struct ColorVector {
  glm::vec3 luma{0.0f};                // [W/m²]
  float axisCo = 0.0f, axisCg = 0.0f;  // [W/m²] <I_Co, e>, <I_Cg, e> for the half's axis e, -x for example
};
ColorVector makeColorVector(std::size_t half, const glm::vec3& luma, const glm::vec3& co, const glm::vec3& cg);

// Irradiance as Y, Co, Cg [W/m²] of the three halves that n reads: E_Y as above, and
//   E_c = E_Y sum_a n_a² c_a / sum_a n_a² s_a (I_a)_a,
// exact at the axes and for light of one colour. No ratio is beyond those of colours without negative parts. [n unit]
glm::vec3 irradianceYCoCg(const std::array<ColorVector, 3>& halves, const glm::vec3& n);

// How a half is packed into six halves of 16 bits, 72 bytes a point.
enum class VectorPacking {
  axes,     // luma x y z, share of light that is known, Co, Cg
  printed,  // norms of the vectors of R, G, B; direction x y z of their sum. For comparisons
};

// Of a half's vectors of R, G, B. Values beyond the largest half, 65504, are clamped to it. share [0..1] is kept by
// `axes` alone.
std::array<std::uint16_t, 6> packVectors(VectorPacking packing, std::size_t half, const std::array<glm::vec3, 3>& rgb,
                                         float share);
// The vectors of R, G, B, as far as the packing has kept them.
std::array<glm::vec3, 3> unpackVectors(VectorPacking packing, std::size_t half,
                                       const std::array<std::uint16_t, 6>& packed);

// A half of 16 bits of a value that is clamped to what halves hold; NaN gives 0.
std::uint16_t packClampedHalf(float value);

}  // namespace relume
