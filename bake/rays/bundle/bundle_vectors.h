// SPDX-License-Identifier: MIT
// Eight floats at a time for the walk of a bundle (bundle_walk.h): vectors of three, and triangles seen from a point.
// Everything is in an anonymous namespace and nothing comes from other headers' inline functions, so that no code for a
// newer processor is linked into an older's path.
#pragma once

#include "bake/rays/bundle/bundle_kernel.h"

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace relume {
namespace {

typedef float Floats __attribute__((vector_size(32)));
typedef std::int32_t Ints __attribute__((vector_size(32)));
constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7};
constexpr float kInfinity = __builtin_inff();

inline Floats load(const float* from) {
  Floats v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
inline void store(float* to, Floats v) { __builtin_memcpy(to, &v, sizeof v); }
inline void store(std::int32_t* to, Ints v) { __builtin_memcpy(to, &v, sizeof v); }
inline Ints loadInts(const std::uint32_t* from) {
  Ints v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
inline void storeInts(std::uint32_t* to, Ints v) { __builtin_memcpy(to, &v, sizeof v); }
inline Floats splat(float v) { return v - Floats{}; }
inline Ints splatInt(std::uint32_t v) { return static_cast<std::int32_t>(v) - Ints{}; }
inline Floats min(Floats a, Floats b) { return a < b ? a : b; }
inline Floats max(Floats a, Floats b) { return a > b ? a : b; }
inline float max(float a, float b) { return a > b ? a : b; }
inline std::uint32_t minOf(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }
inline Floats magnitude(Floats v) { return v < 0.0f ? -v : v; }
inline float magnitude(float v) { return v < 0.0f ? -v : v; }
inline unsigned lowest(unsigned bits) { return static_cast<unsigned>(__builtin_ctz(bits)); }

// A bit for each lane of a mask.
inline unsigned bitsOf(Ints mask) {
#if defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < kBundleLanes; ++i) bits |= (static_cast<unsigned>(mask[i]) >> 31) << i;
  return bits;
#endif
}

#if defined(__AVX2__)
// The numbers of the bits that are set in a byte, in order.
struct SetBits {
  alignas(8) std::uint8_t of[256][8] = {};
  constexpr SetBits() {
    for (unsigned byte = 0; byte < 256; ++byte) {
      for (unsigned bit = 0, n = 0; bit < 8; ++bit) {
        if (byte >> bit & 1u) of[byte][n++] = static_cast<std::uint8_t>(bit);
      }
    }
  }
};
constexpr SetBits kSetBits;
#endif

// Appends those lanes of `v` whose bits are set; anything may lie in the seven places behind them. Returns how many.
inline std::uint32_t append(std::uint32_t* to, Ints v, unsigned bits) {
#if defined(__AVX2__)
  const __m256i order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kSetBits.of[bits])));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32((__m256i)v, order));
  return static_cast<std::uint32_t>(__builtin_popcount(bits));
#else
  std::uint32_t n = 0;
  for (; bits != 0; bits &= bits - 1) to[n++] = static_cast<std::uint32_t>(v[lowest(bits)]);
  return n;
#endif
}

// from[at] in each lane.
inline Floats gather(const float* from, Ints at) {
#if defined(__AVX2__)
  return (Floats)_mm256_i32gather_ps(from, (__m256i)at, 4);
#else
  Floats v;
  for (unsigned i = 0; i < kBundleLanes; ++i) v[i] = from[at[i]];
  return v;
#endif
}

inline float maxLane(Floats v) {
#if defined(__AVX2__)
  const __m128 half = _mm_max_ps(_mm256_castps256_ps128((__m256)v), _mm256_extractf128_ps((__m256)v, 1));
  const __m128 two = _mm_max_ps(half, _mm_movehl_ps(half, half));
  return _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps(two, two, 1)));
#else
  float m = v[0];
  for (unsigned i = 1; i < kBundleLanes; ++i) m = max(m, v[i]);
  return m;
#endif
}

struct Vectors {
  Floats x, y, z;
};
inline Vectors operator-(const Vectors& a, const Vectors& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vectors operator+(const Vectors& a, const Vectors& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vectors cross(const Vectors& a, const Vectors& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Floats dot(const Vectors& a, const Vectors& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }
inline Vectors splat(float x, float y, float z) { return {splat(x), splat(y), splat(z)}; }
inline Floats along(const Vectors& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

// A triangle seen from the point: planes through it and the edges, and how its own plane lies. A ray d passes between
// the edges where its products with the normals have one sign. (p + q) x (q - p) is the same but for the sign for both
// triangles at an edge, so that no ray slips through (Davidovic et al., "3D Rasterization: A Bridge between
// Rasterization and Ray Casting", GI 2012; Woop et al. 2013 say the same of single rays).
struct Triangles {
  Vectors edge[3];  // opposite to corner 0, 1, 2
  Vectors normal;   // N
  Floats plane;     // N . corner
};

inline Triangles seenFrom(const Vectors& a, const Vectors& b, const Vectors& c) {
  const Vectors normal = cross(b - a, c - a);
  return {{cross(b + c, c - b), cross(c + a, a - c), cross(a + b, b - a)}, normal, dot(normal, a)};
}

// How rays pass the edges of triangles.
struct Passing {
  Floats first, second, third;  // the products
  Ints inside;
};

inline Passing pass(const Triangles& triangle, const Vectors& direction) {
  Passing r;
  r.first = dot(triangle.edge[0], direction);
  r.second = dot(triangle.edge[1], direction);
  r.third = dot(triangle.edge[2], direction);
  r.inside = (min(r.first, min(r.second, r.third)) >= 0.0f) | (max(r.first, max(r.second, r.third)) <= 0.0f);
  return r;
}

// Where rays meet the triangles' planes. The products' sum is 2 N . d, too, but rounds more, the farther the triangle.
struct Meeting {
  Floats facing, distance;
};

inline Meeting meet(const Triangles& triangle, const Vectors& direction) {
  const Floats facing = dot(triangle.normal, direction);
  return {facing, triangle.plane / facing};
}

}  // namespace
}  // namespace relume
