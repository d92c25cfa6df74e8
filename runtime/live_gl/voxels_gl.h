// SPDX-License-Identifier: MIT
// The bits of a voxel volume in OpenGL 4.3, found there: those of what stands and those of what moves, in two tables.
// They are the bits that VoxelVolume has (runtime/voxels/voxel_volume.h), all of them and on every driver, because from
// the placing of a vertex on a shader computes with integers (shaders/live_voxelise.comp).
//
//   create()      what stands and what moves, where it is at first
//   move()        a frame: what moves alone, where it is now
//   edit()        the editor: what stands, placed elsewhere, taken away or put back
//   rasterGlsl()  for what the host's own vertex shaders place: drawn into the bits, by three views
//
// A table is a 3-D texture of R32UI, two words a cell: bit x + 4 y + 16 z of a cell's 64 is the voxel (x, y, z) of the
// cell, and the low word is the even texel along x. No call but create() makes an OpenGL object, and bindings that a
// call uses are put back (runtime/gl/saved_state.h). The context that was current in create() is current in every other
// call, and when it dies.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "relume/voxel_geometry.h"
#include "runtime/passes/programs.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// A view that rasterGlsl() is drawn with.
struct VoxelRasterView {
  glm::mat4 clipFromWorld{1.0f};
  std::uint32_t width = 0, height = 0;  // [pixel] of the viewport, which begins at 0
};

struct VoxelsGlOptions {
  GetProcAddress getProcAddress;              // of the context that is current
  std::optional<gpu::GroupThreads> groups{};  // what work groups are to suit; nothing = the driver
};

class VoxelsGl {
 public:
  // The grid of a volume of the same geometry, or any other. usage: checkGeometry(); getProcAddress is empty;
  // unsupported: no OpenGL 4.3, more triangles or vertices than its buffers hold, a grid that its textures do not hold,
  // not isComplete(); failed: a shader's log; memory.
  static Result<VoxelsGl> create(const VoxelGeometry& geometry, const VolumeGrid& grid, const VoxelsGlOptions& options);
  VoxelsGl(VoxelsGl&&) noexcept;
  VoxelsGl& operator=(VoxelsGl&&) noexcept;
  ~VoxelsGl();

  // [Size moving parts, in their order] What was drawn into the table of moving voxels is gone. usage, here and below:
  // as VoxelVolume's, after which nothing has changed. edit() waits for the GPU; unsupported: not isComplete().
  [[nodiscard]] Status move(std::span<const glm::mat4x3> toWorld);
  [[nodiscard]] Status edit(std::span<const PartEdit> edits);

  // Whether the last call has found all voxels. It has, but of triangles that are much larger than the grid and
  // slivers: they are so many pieces that shaders do not finish. Waits for the GPU.
  bool isComplete() const;
  // Textures, of the OpenGL that made them.
  std::uint32_t standing() const;
  std::uint32_t moving() const;
  // Read back. Waits for the GPU. [Size cells]
  std::vector<std::uint64_t> standingBits() const;
  std::vector<std::uint64_t> movingBits() const;

  // Text for a fragment shader of the host's: relumeVoxelWrite() (shaders/live_raster.glsl). It is drawn once for each
  // axis, with culling, depth test and multisampling off, into any target of the view's size. setRasterUniforms() and
  // bindRaster(), which leaves the texture bound to image unit 0, go before.
  static Result<std::string> rasterGlsl();
  VoxelRasterView rasterView(int axis) const;  // [0..2]
  void setRasterUniforms(std::uint32_t program, int axis) const;
  // moving(), whose bits are added to, or a texture of the host's that is like it. usage: it is no 3-D texture of R32UI
  // of that size. After the draws glMemoryBarrier() goes, for what is to read them.
  [[nodiscard]] Status bindRaster(std::uint32_t texture) const;

  // Of the last call of each pass that the GPU has finished.
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  struct State;
  explicit VoxelsGl(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relume
