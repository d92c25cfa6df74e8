// SPDX-License-Identifier: MIT
// See rsm_passes_gl.h.
#include "runtime/live_gl/rsm_passes_gl.h"

#include "runtime/cones/rsm_voxels.h"
#include "runtime/gl/program.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace relume::gl {
namespace {

constexpr std::size_t kSumBytes = 24;  // of a side: three channels of two words

}  // namespace

RsmPasses::RsmPasses(const Functions& gl) : gl_(gl), voxels_(gl), sums_(gl), textures_(gl) {}

Status RsmPasses::compile(Defines defines) {
  for (const auto& [program, path] :
       {std::pair(&program_, "cone_rsm.comp"), std::pair(&lightProgram_, "cone_rsm_light.comp")}) {
    Result<Program> made = makeComputeProgram(gl_, path, defines);
    if (!made) return made.error();
    *program = std::move(*made);
  }
  return done();
}

std::size_t RsmPasses::bytesNeeded(std::uint32_t voxels, std::uint32_t sides) {
  return std::max(sizeof(RelumeRsmVoxel) * voxels, kSumBytes * sides);
}

void RsmPasses::follow(const VoxelVolume& volume, const ConeVolume& found) {
  if (follows_) return;
  const std::vector<RelumeRsmVoxel> voxels = found.rsmVoxels(volume);
  voxels_.reserve(sizeof(RelumeRsmVoxel) * voxels.size());
  voxels_.write(0, bytesOf(voxels));
  sums_.reserve(kSumBytes * volume.sideCount());
  follows_ = true;
}

void RsmPasses::light(const ConeVolume& found, const RsmMaps& maps, const CellTexture& cells,
                      const GrowingRows& radiance) {
  const VolumeGrid& grid = found.grid();
  const float unit = rsmUnit(maps.largestFlux);
  sums_.clear();
  voxels_.bind(RELUME_CONE_SLOT_RSM_VOXELS);
  sums_.bind(RELUME_CONE_SLOT_RSM_SUMS);
  cells.bind(RELUME_LIVE_UNIT_CELLS);
  setUniform(gl_, program_, "relumeLiveOrigin", grid.originWorld);
  setUniform(gl_, program_, "relumeLiveSize", glm::uvec3(grid.cells));
  setUniform(gl_, program_, "relumeRsmPerMetre", 1.0f / grid.voxel);
  setUniform(gl_, program_, "relumeRsmPerWatt", 1.0f / unit);
  setUniform(gl_, program_, "relumeRsmLargest", maps.largestFlux);
  for (const RsmMaps::Map& map : maps.map) {
    textures_.bind(RELUME_CONE_UNIT_RSM_PLACES, map.places);
    textures_.bind(RELUME_CONE_UNIT_RSM_NORMALS, map.normals);
    textures_.bind(RELUME_CONE_UNIT_RSM_FLUX, map.flux);
    setUniform(gl_, program_, "relumeRsmSide", map.width);
    runThreads(gl_, program_, map.width * map.height);
  }
  waitForShaders(gl_);
  radiance.bindImage(0, GL_WRITE_ONLY);
  setUniform(gl_, lightProgram_, "relumeRsmUnit", unit);
  setUniform(gl_, lightProgram_, "relumeRsmEmissionScale", maps.emissionScale);
  runThreads(gl_, lightProgram_, found.count());
}

}  // namespace relume::gl
