// SPDX-License-Identifier: MIT
// A level as a voxel volume takes it (relume/voxel_geometry.h): triangles of what is drawn, cut into pieces of
// two voxels' width, each with the mean of its textures.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"
#include "relume/voxel_geometry.h"
#include "tools/render/scene_bounds.h"

#include <cstdint>
#include <vector>

namespace relume {

class VoxelScene {
 public:
  // pieceWidth: longest edge of a piece [m] [> 0]. What lies out of the box, where there is one, stays in large pieces.
  // A part for each instance, in their order; what is dynamic moves.
  // failed: more than 2^25 pieces, or cancelled.
  static Result<VoxelScene> create(const Scene& scene, float pieceWidth, Context& context,
                                   const SceneBounds* box = nullptr);
  VoxelScene(VoxelScene&&) = default;
  VoxelScene& operator=(VoxelScene&&) = default;

  // Valid as long as this.
  VoxelGeometry geometry() const { return {surfaces_, meshes_, parts_}; }

 private:
  struct Pieces {
    std::vector<glm::vec3> position;
    std::vector<glm::uvec3> triangle;
    std::vector<std::uint32_t> surface;
  };
  VoxelScene() = default;

  std::vector<VoxelSurface> surfaces_;
  std::vector<Pieces> pieces_;  // of each instance
  std::vector<VoxelMesh> meshes_;
  std::vector<VoxelPart> parts_;
};

}  // namespace relume
