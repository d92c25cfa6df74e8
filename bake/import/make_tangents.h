// SPDX-License-Identifier: MIT
// The tangents that a normal map is laid out by.
#pragma once

#include "relume/bake/scene.h"

#include <glm/vec4.hpp>

#include <cstddef>
#include <span>

namespace relume {

// Fill mesh.cornerTangent. `given`: the mesh's TANGENT attribute, which counts where the mesh has normals [Size
// vertices, or 0 = none]; else tangents follow from the texture coordinates that `map` uses, transformed as it says, as
// MikkTSpace has them: the triangles' directions of growing u, across the normal, weighted by their angles at the
// corner and summed over the corners that share position, normal, coordinates and side. Normals of a mesh without are
// its triangles'. Returns how many triangles have no tangent: there are no coordinates, or none with an area. [Size of
// all indices: checked]
std::size_t makeTangents(Mesh& mesh, std::span<const glm::vec4> given, const TextureRef& map);

}  // namespace relume
