// SPDX-License-Identifier: MIT
// See voxel_geometry.h.
#include "runtime/voxels/check_geometry.h"
#include "formats/decimal.h"
#include "formats/limits.h"

#include <string>
#include <utility>

namespace relume {
namespace {

Error refused(const std::string& what) { return Error{ErrorCode::usage, "voxels: " + what}; }

std::string text(const glm::vec3& v) { return "(" + decimal(v.x) + ", " + decimal(v.y) + ", " + decimal(v.z) + ")"; }

// Comparisons that NaN fails.
bool isShare(float v) { return v >= 0.0f && v <= 1.0f; }

Error wrongGeometry(std::string what) { return Error{ErrorCode::usage, std::move(what)}; }

}  // namespace

Status checkVoxelSurface(const VoxelSurface& surface) {
  if (!isShare(surface.albedo.x) || !isShare(surface.albedo.y) || !isShare(surface.albedo.z))
    return wrongGeometry("albedo " + text(surface.albedo) + ", expected 0 to 1 in each channel");
  if (!isRadiance(surface.emission))
    return wrongGeometry("emission " + text(surface.emission) + ", expected 0 to " + decimal(kMaxRadiance) +
                         " W/m²/sr in each channel");
  if (!isShare(surface.coverage)) return wrongGeometry("coverage " + decimal(surface.coverage) + ", expected 0 to 1");
  return done();
}

Status checkVoxelMesh(const VoxelMesh& mesh, std::size_t surfaces) {
  if (mesh.surface.size() != mesh.triangle.size())
    return wrongGeometry(std::to_string(mesh.surface.size()) + " surfaces for " + std::to_string(mesh.triangle.size()) +
                         " triangles, expected one each");
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    if (!isWithin(mesh.position[i], kMaxLevelCoordinate))
      return wrongGeometry("vertex " + std::to_string(i) + " at " + text(mesh.position[i]) +
                           ", expected coordinates within " + decimal(kMaxLevelCoordinate) + " m");
  }
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      if (mesh.triangle[t][k] >= mesh.position.size())
        return wrongGeometry("triangle " + std::to_string(t) + " has vertex " + std::to_string(mesh.triangle[t][k]) +
                             " of " + std::to_string(mesh.position.size()));
    }
    if (mesh.surface[t] >= surfaces)
      return wrongGeometry("triangle " + std::to_string(t) + " has surface " + std::to_string(mesh.surface[t]) +
                           " of " + std::to_string(surfaces));
  }
  return done();
}

Status checkTransform(const glm::mat4x3& toWorld, std::size_t part) {
  for (int column = 0; column < 4; ++column) {
    if (!isWithin(toWorld[column], kMaxLevelCoordinate))
      return refused("part " + std::to_string(part) + ": column " + std::to_string(column) + " of toWorld is " +
                     text(toWorld[column]) + ", expected numbers within " + decimal(kMaxLevelCoordinate));
  }
  return done();
}

Status checkGeometry(const VoxelGeometry& geometry) {
  for (std::size_t i = 0; i < geometry.surfaces.size(); ++i) {
    if (Status ok = checkVoxelSurface(geometry.surfaces[i]); !ok)
      return refused("surface " + std::to_string(i) + ": " + ok.error().message);
  }
  for (std::size_t i = 0; i < geometry.meshes.size(); ++i) {
    if (Status ok = checkVoxelMesh(geometry.meshes[i], geometry.surfaces.size()); !ok)
      return refused("mesh " + std::to_string(i) + ": " + ok.error().message);
  }
  for (std::size_t i = 0; i < geometry.parts.size(); ++i) {
    const VoxelPart& part = geometry.parts[i];
    if (part.mesh >= geometry.meshes.size())
      return refused("part " + std::to_string(i) + " has mesh " + std::to_string(part.mesh) + " of " +
                     std::to_string(geometry.meshes.size()));
    if (Status ok = checkTransform(part.toWorld, i); !ok) return ok;
  }
  return done();
}

Error noMemoryForVoxels() { return {ErrorCode::memory, "voxels: memory ran out; fewer cells or cascades take less"}; }

}  // namespace relume
