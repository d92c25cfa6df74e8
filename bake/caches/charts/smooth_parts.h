// SPDX-License-Identifier: MIT
// Gives small smooth parts, such as a ball, a bust or a pipe, smaller texels. Where normals turn by a large part of a
// radian from texel to texel, texels show as facets and borders of charts as seams, and neighbouring caches that look
// so differently miss light between them. So such parts get texels that are small enough for their curvature, at the
// expense of all other surfaces, within a budget.
//
// A part is a set of faces that are joined over edges at which the mesh's own normals agree. Its curvature is how much
// the normal turns per metre, summed over the two directions of the surface and averaged over it: sum of t l / area,
// with t the angle by which the normal turns at an edge of length l. For a ball of radius r it is 2 / r.
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

// A part of an instance.
struct SmoothPart {
  std::uint32_t instance = 0;
  float area = 0.0f;       // [m²] that is seen
  float curvature = 0.0f;  // [1/m]
  float density = 1.0f;    // of its patches before followCurvature()
  float factor = 1.0f;     // by which followCurvature() raised it
};

// [rad] Texels follow a part until curvature times texel size is this. A ball of radius r gets texels of 0.15 r.
inline constexpr float kMaxTurn = 0.3f;

// Whether a part may have too few texels of this size [m] to show its form, but is large enough to be looked at.
bool isFollowed(const SmoothPart& part, float texelSize);

// Set the density of all patches of smooth parts, for texels of this size [m].
void followCurvature(PatchSet& set, float texelSize);

}  // namespace relume
