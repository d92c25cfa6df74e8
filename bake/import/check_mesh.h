// SPDX-License-Identifier: MIT
// What is wrong with the meshes of a level, found with CGAL: degenerate and duplicate triangles, non-manifold edges,
// open borders, flipped winding. Reported by node and triangle; the baker copes with all of it.
#pragma once

#include "relume/bake/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace relume {

struct MeshFinding {
  enum class Kind { degenerateTriangle, duplicateTriangle, nonManifoldEdge, openBorder, flippedWinding, repaired };
  Kind kind;
  std::uint32_t mesh = 0;      // index into Scene::meshes
  std::uint32_t count = 0;     // how many of that kind in that mesh
  std::uint32_t triangle = 0;  // the first of them
  std::string node;            // a node that uses the mesh
};

const char* toString(MeshFinding::Kind kind);

// One finding per mesh and kind. Degenerate = zero area within rounding; a duplicate has the same three points, in any
// order; flipped winding = a face that disagrees with its neighbours' orientation or with the mesh's own normals.
std::vector<MeshFinding> checkMeshes(const Scene& scene, Context& context);

// Repair what is safe to repair: the second and later of equal triangles (same points, same winding, same mesh) lie on
// the first and would send its light twice; they collapse to their first vertex, so that numbering stays. One finding
// of kind `repaired` per mesh that changed.
std::vector<MeshFinding> repairMeshes(Scene& scene, Context& context);

}  // namespace relume
