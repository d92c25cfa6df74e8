// SPDX-License-Identifier: MIT
// A mesh's surface in one number that does not depend on how the mesh is stored: relume export splits vertices, and
// tools that optimise a level for drawing reorder vertices and triangles.
#pragma once

#include "relume/bake/scene.h"

#include <cstdint>

namespace relume {

// Hash of the positions and normals at the corners of all triangles, exact to the last bit. Equal for meshes whose
// triangles come in another order, begin at another corner, or share other vertices; winding counts. Normals that the
// file does not have (Mesh::normalsRepaired) depend on which triangles share a vertex and are left out. Any thread.
std::uint64_t hashSurface(const Mesh& mesh);

}  // namespace relume
