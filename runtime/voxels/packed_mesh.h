// SPDX-License-Identifier: MIT
// Meshes as a volume keeps them, to find voxels anew when parts or the volume move: in runs of 64 triangles that have
// each of their vertices and surfaces once, so that a triangle names them by a byte. Nothing is rounded.
#pragma once

#include "relume/relighter.h"
#include "relume/voxel_geometry.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/summed_surfaces.h"
#include "runtime/voxels/triangle_runs.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

// The triangles of a mesh that are there.
struct PackedMesh {
  std::vector<TriangleRun> run;                       // of kTrianglesOfRun triangles each but the last
  std::vector<glm::vec3> vertex;                      // of one run after the other
  std::vector<std::array<std::uint8_t, 4>> triangle;  // three of its run's vertices, and one of its surfaces

  std::uint32_t trianglesOf(std::size_t r) const {
    const std::size_t first = r * kTrianglesOfRun;
    return static_cast<std::uint32_t>(std::min<std::size_t>(kTrianglesOfRun, triangle.size() - first));
  }
  std::size_t bytes() const;
};

struct PackedGeometry {
  std::vector<PackedMesh> mesh;
  SummedSurfaces surfaces;  // of the runs of all meshes
};

// Whether a triangle of a surface with this coverage is there, by a hash of its number: the same ones each time. [0..1]
bool isThere(float coverage, std::uint32_t triangle);

// geometry: checkGeometry()
PackedGeometry packGeometry(const VoxelGeometry& geometry, const ParallelFor& parallelFor);

// snapTriangles() of runs [begin, end); surfaces are those of the packed geometry. Runs of which RunsOutside says that
// nothing is in the box count as outside.
bool snapRuns(const VolumeGrid& grid, const SnapBox& box, const PackedMesh& mesh, const glm::mat4x3& toWorld,
              std::uint32_t begin, std::uint32_t end, std::vector<SnappedTriangle>& snapped, SnapCounts& counts);

}  // namespace relume
