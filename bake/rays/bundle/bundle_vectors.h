// SPDX-License-Identifier: MIT
// The vectors of simd/vectors.h with eight lanes for the walk of a bundle (bundle_walk.h), and triangles seen from a
// point. What simd/vectors.h says of functions holds here, too.
#pragma once

#include "bake/rays/bundle/bundle_kernel.h"
#include "simd/vectors.h"

namespace relume {
namespace {

using Floats = FloatsOf<kBundleLanes>;
using Ints = IntsOf<kBundleLanes>;
using Vectors = Vectors3<Floats>;
constexpr Ints kLane = {0, 1, 2, 3, 4, 5, 6, 7};
constexpr float kInfinity = __builtin_inff();

inline Floats load(const float* from) { return load<Floats>(from); }
inline Ints loadInts(const std::uint32_t* from) { return load<Ints>(from); }
inline Floats splat(float v) { return splat<Floats>(v); }
inline Ints splatInt(std::uint32_t v) { return splat<Ints>(static_cast<std::int32_t>(v)); }
inline Vectors splat(float x, float y, float z) { return {splat(x), splat(y), splat(z)}; }
inline Floats along(const Vectors& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

// A triangle seen from the origin: the normals of the planes through the origin and its edges, and its own plane. A ray
// d passes between the edges when its products with these normals have the same sign. The normal (p + q) x (q - p) of
// an edge differs only by its sign between the two triangles at the edge, so that no ray slips through (Davidovic et
// al., "3D Rasterization: A Bridge between Rasterization and Ray Casting", GI 2012; Woop et al. 2013 do it for single
// rays).
struct Triangles {
  Vectors edge[3];  // opposite to corner 0, 1, 2
  Vectors normal;   // N
  Floats plane;     // N . corner
};

inline Triangles seenFrom(const Vectors& a, const Vectors& b, const Vectors& c) {
  const Vectors normal = cross(b - a, c - a);
  return {{cross(b + c, c - b), cross(c + a, a - c), cross(a + b, b - a)}, normal, dot(normal, a)};
}

// On which side of a triangle's edges rays pass.
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

// Distances at which rays meet the triangles' planes. The sum of the three products would be 2 N . d, too, but its
// rounding error grows with the triangle's distance.
struct Meeting {
  Floats facing, distance;
};

inline Meeting meet(const Triangles& triangle, const Vectors& direction) {
  const Floats facing = dot(triangle.normal, direction);
  return {facing, triangle.plane / facing};
}

}  // namespace
}  // namespace relume
