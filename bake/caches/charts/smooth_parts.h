// SPDX-License-Identifier: MIT
// Small smooth parts: a ball, a bust, a pipe. Normals that turn by a good part of a radian from texel to texel show the
// texels as facets and the borders of charts as seams, and caches that look so differently miss light between them. So
// such parts get texels small enough for their curvature, at the expense of all others, within a budget.
//
// A part is a set of faces joined over edges at which the mesh's own normals agree. Its curvature is the mean over its
// surface of how much the normal turns, summed over the two directions of a surface: with an edge of length l at which
// it turns by t, sum t l / area, which is 2 / r for a ball of radius r.
#pragma once

#include "bake/caches/charts/segment.h"
#include "relume/bake/scene.h"

#include <cstdint>
#include <vector>

namespace relume {

struct PatchSet;

struct MeshParts {
  std::vector<std::uint32_t> partOf;  // [Size triangles] kNone = not smooth; empty when no part is
  std::vector<float> curvature;       // [1 / object unit] [Size parts]
};

// The smooth parts of a mesh that are curved at all.
MeshParts findSmoothParts(const Mesh& mesh);

// A part at its place.
struct SmoothPart {
  std::uint32_t instance = 0;
  float area = 0.0f;       // [m²] that is seen
  float curvature = 0.0f;  // [1/m]
  float density = 1.0f;    // of its patches before followCurvature()
  float factor = 1.0f;     // by which followCurvature() raised it
};

// Curvature times texel size up to which texels follow a part. A ball of radius r gets texels of 0.15 r.
inline constexpr float kMaxTurn = 0.3f;

// Whether a part has so few texels of a size [m] that its form does not come out, and enough to be looked at.
bool isSmall(const SmoothPart& part, float texelSize);

// Set the density of all patches of smooth parts for texels of a size. [m]
void followCurvature(PatchSet& set, float texelSize);

}  // namespace relume
